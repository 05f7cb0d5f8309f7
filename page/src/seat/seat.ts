/** A person's seat: what the server tells of it, and what the person says. */

import { batch, computed, effect, signal } from "@preact/signals";
import { address } from "../api";
import type { PageNote, SeatBriefing, SeatQuestion, SeatReply, SeatState, SeatTake } from "../wire";
import { addCall, addMessage, callOf, type Argument } from "./draft";
import { candidates, wanted, type Picking } from "./picking";

/** Seconds until the connection is tried again. */
const AGAIN_S = 1;
/** Messages that stay readable; an observation has each of them once. */
const MOST_LETTERS = 60;

/** Whether an address is that of a seat. */
export const isSeat = (path: string) => /\/seat\/[^/]+\/[^/]+\/$/.test(path);

export const connected = signal(false);
export const briefing = signal<SeatBriefing | null>(null);
export const question = signal<SeatQuestion | null>(null);
export const state = signal<SeatState | null>(null);
/** The last words of the server on what was sent. */
export const note = signal<PageNote | null>(null);
/** When the time for an answer is over, by the clock of the page; null for no limit. */
export const deadline = signal<number | null>(null);
/** The answer that is being written. */
export const draft = signal(kept("draft"));
/** Drafts before the last changes by a button. */
const before = signal<readonly string[]>([]);
export const canUndo = computed(() => before.value.length > 0);
/** The answer that was sent last. */
export const lastSent = signal("");
/** Whether an answer is on its way. */
export const sending = signal(false);
export const picking = signal<Picking | null>(null);
/** Messages that were read and sent, the newest last. */
export const letters = signal<readonly { step: number; from: string; to: string; text: string }[]>([]);

const chosenTeam = signal("");
/** The team that gets the next order: the one that was chosen, while it is there. */
export const team = computed(() => {
  const teams = question.value?.view.teams ?? [];
  return teams.find((t) => t.name === chosenTeam.value) ?? teams[0];
});

/** What will do as the next argument, in the order of its numbers. */
export const offers = computed(() => (picking.value && question.value ? candidates(picking.value, question.value.view) : []));

let socket: WebSocket | null = null;
/** Whether the connection was lost while an answer was on its way. */
let unsure = false;

/** Connect, and again whenever the connection is lost, until the match is over. */
export function begin(): void {
  history.replaceState(null, "", location.pathname); // the cookie has the token now
  effect(() => keep("draft", draft.value));
  connect();
}

function connect(): void {
  socket = new WebSocket(`${address("live", "ws")}?window=${windowName()}`);
  socket.onopen = () => (connected.value = true);
  socket.onmessage = (event) => hear(JSON.parse(String(event.data)) as SeatBriefing | SeatQuestion | SeatState | PageNote);
  socket.onclose = () => {
    unsure = sending.value;
    batch(() => {
      connected.value = false;
      sending.value = false;
    });
    if (!state.value?.over) setTimeout(connect, AGAIN_S * 1000);
  };
}

/** Take what the server says. */
export function hear(told: SeatBriefing | SeatQuestion | SeatState | PageNote): void {
  batch(() => {
    if (told.kind === "briefing") briefing.value = told;
    else if (told.kind === "question") ask(told);
    else if (told.kind === "state") {
      state.value = told;
      deadline.value = told.left_s === null ? null : performance.now() + told.left_s * 1000;
      if (unsure && told.sent === draft.value) finish();
      unsure = false;
    } else settle(told);
  });
}

function ask(told: SeatQuestion): void {
  const known = question.value;
  question.value = told;
  if (known?.episode !== told.episode || known.step !== told.step) {
    const read = told.messages.filter((m) => !m.again).map((m) => ({ step: told.step, from: m.sender, to: m.recipient, text: m.text }));
    letters.value = [...letters.value, ...read].slice(-MOST_LETTERS);
  }
  const open = picking.value;
  const still = open && told.view.teams.find((t) => t.name === open.team)?.actions.some((a) => a.name === open.action.name);
  if (!still) picking.value = null;
}

/** End a send: a draft that did not arrive stays. */
function settle(told: PageNote): void {
  note.value = told;
  if (!sending.value) return;
  sending.value = false;
  if (told.ok) finish();
}

/** Begin a new draft: the one before has arrived. */
function finish(): void {
  lastSent.value = draft.value;
  draft.value = "";
  before.value = [];
  picking.value = null;
}

/** Send the draft as the answer to the newest question; nothing in it means to carry on. */
export function send(): void {
  const asked = question.value;
  if (!asked || sending.value || !state.value?.waits || !state.value.mine) return;
  if (say({ kind: "reply", episode: asked.episode, step: asked.step, text: draft.value })) sending.value = true;
}

/** Play the seat in this window from now on. */
export const take = () => void say({ kind: "take" });

function say(words: SeatReply | SeatTake): boolean {
  if (socket?.readyState === WebSocket.OPEN) {
    socket.send(JSON.stringify(words));
    return true;
  }
  note.value = { kind: "note", ok: false, text: "There is no connection: your draft is kept." };
  return false;
}

export function chooseTeam(name: string): void {
  batch(() => {
    chosenTeam.value = name;
    picking.value = null;
  });
}

/** Begin an action of the chosen team; one without arguments is ordered at once. */
export function choose(action: Picking["action"]): void {
  const name = team.value?.name;
  if (name) go({ team: name, action, args: [] });
}

/** Take an argument for the action that is being picked. */
export function pick(argument: Argument): void {
  const open = picking.value;
  if (open) go({ ...open, args: [...open.args, argument] });
}

function go(next: Picking): void {
  if (wanted(next) !== null) picking.value = next;
  else
    batch(() => {
      write(addCall(draft.value, next.team, callOf(next.action, next.args)));
      picking.value = null;
    });
}

/** Put a message into the draft. */
export const tell = (to: string, words: string) => write(addMessage(draft.value, to, words));

/** Replace the draft, so that it can be undone. */
export function write(text: string): void {
  batch(() => {
    before.value = [...before.value, draft.value];
    draft.value = text;
  });
}

export function undo(): void {
  const last = before.value.at(-1);
  if (last === undefined) return;
  batch(() => {
    draft.value = last;
    before.value = before.value.slice(0, -1);
  });
}

/** Return the name of this window, which it keeps when it is loaded again. */
function windowName(): string {
  const name = kept("window") || crypto.getRandomValues(new Uint32Array(3)).join("-");
  keep("window", name);
  return name;
}

function kept(name: string): string {
  try {
    return sessionStorage.getItem(`khala-${name}${location.pathname}`) ?? "";
  } catch {
    return "";
  }
}

function keep(name: string, text: string): void {
  try {
    sessionStorage.setItem(`khala-${name}${location.pathname}`, text);
  } catch {
    // a window that may keep nothing begins anew
  }
}
