/** A match that is being played: what is new comes over a websocket, advice goes up on it. */

import { signal } from "@preact/signals";
import { address, isExport } from "./api";
import type { Match } from "./match";
import type { AdviceNote, Note, Progress } from "./wire";

/** Seconds until the connection is tried again. */
const AGAIN_S = 2;

/** The last words of the server on an advice. */
export const note = signal<Note | null>(null);

export class Live {
  private socket: WebSocket | null = null;
  private ended = false;
  private growing: Promise<void> = Promise.resolve();

  constructor(private readonly match: Match) {
    if (!isExport()) this.connect();
  }

  /** Send advice to agents; the answer comes as `note`. */
  advise(advice: Omit<AdviceNote, "kind">): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ kind: "advice", ...advice }));
    else note.value = { kind: "note", ok: false, text: "There is no connection to the match." };
  }

  close(): void {
    this.ended = true;
    this.socket?.close();
  }

  private connect(): void {
    const socket = new WebSocket(address(`runs/${this.match.id}/live`, "ws"));
    this.socket = socket;
    socket.onmessage = (event) => this.hear(JSON.parse(String(event.data)) as Progress | Note);
    socket.onclose = () => {
      if (!this.ended && this.match.grows()) setTimeout(() => this.ended || this.connect(), AGAIN_S * 1000);
    };
  }

  /** Take a line of the server; one after the other, since a slow answer must not overtake. */
  private hear(told: Progress | Note): void {
    if (told.kind === "note") note.value = told;
    else this.growing = this.growing.then(() => this.match.grow(told)).catch(() => undefined);
  }
}
