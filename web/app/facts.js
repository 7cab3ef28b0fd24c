// What webpage.py knew when it wrote this page, as one JSON object in it. `facts` begins as the header line of every
// generated text does; `shared` holds the constants that Python and these scripts have in common.
export const facts = JSON.parse(document.getElementById("facts").textContent);
export const {shared} = facts;
