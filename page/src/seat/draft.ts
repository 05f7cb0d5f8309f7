/** The text of an answer, as agents write it: buttons add calls and messages to it, and the person may edit it. */

import type { ActionSpec } from "../wire";

const ACTIONS = /^\s*Actions:\s*$/i;
const COMMUNICATIONS = /^\s*Communications:\s*$/i;
const TEAM = /^\s*Team\s+(\S+?):\s*$/i;

/** An argument of a call: a tag, or a point of the frame that the action takes. */
export type Argument = string | readonly [number, number];

/** Return a call: `<Attack_Unit(0x1)>`, `<Move_Screen([20, 9])>`, `<Hold_Position()>`. */
export function callOf(action: Pick<ActionSpec, "name">, args: readonly Argument[]): string {
  const words = args.map((arg) => (typeof arg === "string" ? arg : `[${arg[0]}, ${arg[1]}]`));
  return `<${action.name}(${words.join(", ")})>`;
}

/** Return a text with one more call of a team, behind the team's others. */
export function addCall(text: string, team: string, call: string): string {
  const lines = linesOf(text);
  const [from, to] = section(lines, ACTIONS, "Actions:");
  const heading = lines.findIndex((line, i) => i >= from && i < to && TEAM.exec(line)?.[1] === team);
  const line = `        ${call}`;
  if (heading < 0) return insert(lines, endOf(lines, from, to), `    Team ${team}:`, line);
  const next = lines.findIndex((other, i) => i > heading && i < to && TEAM.test(other));
  return insert(lines, endOf(lines, heading + 1, next < 0 ? to : next), line);
}

/** Return a text with one more message. */
export function addMessage(text: string, to: string, words: string): string {
  const lines = linesOf(text);
  const [from, end] = section(lines, COMMUNICATIONS, "Communications:");
  const plain = words.trim().replaceAll("'''", '"'); // three quotes would end the message
  return insert(lines, endOf(lines, from, end), `    <MessageTo(${to}, '''${plain}''')>`);
}

const linesOf = (text: string) => (text.trim() ? text.trimEnd().split("\n") : []);

/** Return where the lines below a heading begin and end; add the heading if there is none, actions before messages. */
function section(lines: string[], heading: RegExp, words: string): [number, number] {
  let at = lines.findIndex((line) => heading.test(line));
  if (at < 0) {
    const other = heading === ACTIONS ? lines.findIndex((line) => COMMUNICATIONS.test(line)) : -1;
    at = other < 0 ? lines.length : other;
    lines.splice(at, 0, words);
  }
  const next = lines.findIndex((line, i) => i > at && (ACTIONS.test(line) || COMMUNICATIONS.test(line)));
  return [at + 1, next < 0 ? lines.length : next];
}

/** Return the place behind the last line of a part that is not blank. */
function endOf(lines: readonly string[], from: number, to: number): number {
  let end = to;
  while (end > from && !lines[end - 1].trim()) end--;
  return end;
}

function insert(lines: string[], at: number, ...more: string[]): string {
  lines.splice(at, 0, ...more);
  return `${lines.join("\n")}\n`;
}
