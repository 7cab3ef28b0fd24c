import {facts} from "./facts.js";
import {ownModel} from "./models.js";
import {MplicitsView} from "./view_element.js";

// Adds this module's model to the element, which the first module of a page defines.
const TAG = "mplicits-view";
const {models: known} = customElements.get(TAG) ?? MplicitsView;
if (!known.has(facts.name)) known.set(facts.name, ownModel);
if (!customElements.get(TAG)) customElements.define(TAG, MplicitsView);
