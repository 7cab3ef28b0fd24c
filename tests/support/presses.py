"""Presses every control of a page once, as a curious visitor does."""

from playwright.sync_api import Dialog, Page

from support.browser import Visit

CONTROLS = "button, summary, label:has(> input[type=radio]), input[type=range], select"
TROUBLE = ("Unexpected error", "Cannot read", "undefined", "NaN", "[object")
"""Parts of messages that no visitor should see."""


def press_everything(visited: Visit, within: str = "body", pressed: set[str] | None = None) -> None:
    """Press every control inside an element, those that appear meanwhile too.

    pressed: names of the controls that were pressed on other pages, which are left out; new names are added. Raises
    AssertionError for a message or an error that no visitor should see.
    """
    page, known = visited.page, sorted(pressed or ())
    page.on("dialog", Dialog.dismiss)
    while (name := _next(page, within, known)) is not None:
        if pressed is not None:
            pressed.add(name)
        page.wait_for_timeout(50)
        shown = page.inner_text("body")
        assert not [part for part in TROUBLE if part in shown], f"after {name!r}: {shown}"
        assert visited.console == [], f"after {name!r}"
        page.keyboard.press("Escape")


def _next(page: Page, within: str, known: list[str]) -> str | None:
    """Press the first visible control that was not pressed. Returns its name; None if there is none.

    known: names of controls that are left out, except those that show others.
    """
    name: str | None = page.evaluate(
        """([within, controls, known]) => {
            const all = [...document.querySelectorAll(`:is(${within}) :is(${controls})`)];
            const nameOf = (each) => each.innerText || each.getAttribute("aria-label") || each.id;
            const isKnown = (each) => known.includes(nameOf(each)) && !each.matches("[aria-expanded], summary");
            const next = all.find((each) => (
                !each.wasPressed && each.checkVisibility() && !each.disabled && !isKnown(each)));
            if (!next) return null;
            next.wasPressed = true;
            const name = nameOf(next);
            if (next.type === "range") {
                next.value = String((Number(next.min) + Number(next.max)) / 2);
                next.dispatchEvent(new Event("input", {bubbles: true}));
            } else {
                next.click();
            }
            return name;
        }""",
        [within, CONTROLS, known],
    )
    return name
