/** Keys of a seat: those that no field takes, and ctrl and enter everywhere. */

import { offers, picking, pick, question, choose, chooseTeam, send, team, undo } from "./seat";

export const ACTION_KEYS = "qwertyuiop";

export const HINTS: readonly (readonly [string, string])[] = [
  ["1 … 9", "choose a team; while you pick a target, the target of that number"],
  ["q w e r …", "choose an action of the team, in the order of the buttons"],
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
  const action = key.length === 1 ? team.value?.actions[ACTION_KEYS.indexOf(key)] : undefined;
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
