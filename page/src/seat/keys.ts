/** Keys of a seat: those that no field takes, and ctrl and enter everywhere. */

import type { ActionSpec } from "../wire";
import { briefing, choose, chooseTeam, offers, pick, picking, question, send, team, undo } from "./seat";

const ACTION_KEYS = "qwertyuiopasdfghjklxcvbnm";

/** Return the key of an action, the same in all steps; "" if there are more actions than keys. */
export const keyOf = (action: Pick<ActionSpec, "name">) => ACTION_KEYS[briefing.value?.actions.indexOf(action.name) ?? -1] ?? "";

export const HINTS: readonly (readonly [string, string])[] = [
  ["1 … 9", "choose a team; while you pick a target, the target of that number"],
  ["letters", "choose the action whose button has the letter"],
  ["arrows, enter", "on the map: move the cross, pick what is there"],
  ["esc", "pick nothing"],
  ["z", "undo"],
  ["ctrl enter", "send, also from within the text"],
];

/** Listen to keys; return a function that ends it. */
export function listen(): () => void {
  addEventListener("keydown", onKey);
  return () => removeEventListener("keydown", onKey);
}

function onKey(event: KeyboardEvent): void {
  if (event.defaultPrevented) return;
  if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) send();
  else if (event.key === "Escape" && picking.value) picking.value = null;
  else if (event.ctrlKey || event.metaKey || event.altKey || isField(event.target as HTMLElement) || !plain(event.key.toLowerCase())) return;
  event.preventDefault();
}

/** Do what a key without others means; return whether it means anything. */
function plain(key: string): boolean {
  if (/^[1-9]$/.test(key)) return numbered(Number(key) - 1);
  if (key === "z") undo();
  const action = team.value?.actions.find((one) => keyOf(one) === key);
  if (action) choose(action);
  return key === "z" || action !== undefined;
}

function numbered(index: number): boolean {
  const offer = offers.value[index];
  const other = question.value?.view.teams[index];
  if (picking.value) offer && pick(offer.argument);
  else if (other) chooseTeam(other.name);
  return picking.value !== null || other !== undefined;
}

const isField = (target: HTMLElement) => target.closest?.("input, textarea, select") != null;
