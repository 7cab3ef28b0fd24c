import {facts} from "../model/facts.js";
import {ownModel} from "./models.js";
import {MplicitsView} from "./view_element.js";

// Adds this module's model to the element, which the first module of a page defines; not on a server, without browser.
const TAG = "mplicits-view", registry = "matchMedia" in globalThis ? customElements : null;
const {models: known} = /** @type {typeof MplicitsView} */ (registry?.get(TAG) ?? MplicitsView);
if (!known.has(facts.name)) known.set(facts.name, ownModel);
if (registry && !registry.get(TAG)) registry.define(TAG, MplicitsView);
