/** The facts from web/page.py, as one JSON object in the page: the header of every generated text, and in `shared`
 * the constants shared by Python and JavaScript.
 * @type {Facts} */
export const facts = JSON.parse(document.getElementById("facts").textContent);
export const {shared} = facts;
