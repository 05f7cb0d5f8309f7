/** Mentions of the unit that is pointed at on the map are marked in all texts, by one rule of style for its tag. */

import { effect } from "@preact/signals";
import { chosen, hovered } from "../stage";

/** Chosen units whose mentions are marked; more would mark everything. */
const MOST_CHOSEN = 24;

/** Keep the rule that of the unit that is pointed at, and of the chosen ones. */
export function keepLit(): void {
  const sheet = new CSSStyleSheet();
  document.adoptedStyleSheets = [...document.adoptedStyleSheets, sheet];
  effect(() => {
    const tags = [hovered.value, ...(chosen.value.size <= MOST_CHOSEN ? chosen.value : [])].filter(Boolean);
    const rule = `{ background: var(--lit); color: var(--on-lit); }`;
    sheet.replaceSync(tags.map((tag) => `[data-tag="${tag}"] ${rule}`).join("\n"));
  });
}
