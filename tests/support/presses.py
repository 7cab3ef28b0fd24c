"""Presses every control of a page once, as a curious visitor does."""

from playwright.sync_api import Dialog, Page

from support.browser import Visit

CONTROLS = "button, summary, label:has(> input[type=radio]), input[type=range], select"
TROUBLE = ("Unexpected error", "Cannot read", "undefined", "NaN", "[object")
"""Parts of messages that no visitor should see."""


def press_everything(visited: Visit, within: str = "body") -> list[str]:
    """Press every control inside an element, those that appear meanwhile too. Returns their names.

    Raises AssertionError for a message or an error that no visitor should see.
    """
    page, pressed = visited.page, []
    page.on("dialog", Dialog.dismiss)
    while (name := _next(page, within)) is not None:
        pressed.append(name)
        page.wait_for_timeout(50)
        shown = page.inner_text("body")
        assert not [part for part in TROUBLE if part in shown], f"after {name!r}: {shown}"
        assert visited.console == [], f"after {name!r}"
        page.keyboard.press("Escape")
    return pressed


def _next(page: Page, within: str) -> str | None:
    """Press the first visible control that was not pressed. Returns its name; None if there is none."""
    name: str | None = page.evaluate(
        """([within, controls]) => {
            const all = [...document.querySelectorAll(`:is(${within}) :is(${controls})`)];
            const next = all.find((each) => !each.wasPressed && each.checkVisibility() && !each.disabled);
            if (!next) return null;
            next.wasPressed = true;
            if (next.type === "range") {
                next.value = String((Number(next.min) + Number(next.max)) / 2);
                next.dispatchEvent(new Event("input", {bubbles: true}));
            } else {
                next.click();
            }
            return next.innerText || next.getAttribute("aria-label") || next.id;
        }""",
        [within, CONTROLS],
    )
    return name
