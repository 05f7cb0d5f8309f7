/** A match that is being played: what is new comes over a websocket, advice goes up on it. */

import { signal } from "@preact/signals";
import { address, isExport } from "./api";
import type { Match } from "./match";
import type { AdviceNote, PageNote, RecordingProgress } from "./wire";

/** Seconds until the connection is tried again. */
const AGAIN_S = 2;
/** Seconds between two looks at what is new at least, so that a long match does not keep the server busy. */
const REST_S = 0.3;

/** The last words of the server on an advice. */
export const note = signal<PageNote | null>(null);

export class Live {
  private socket: WebSocket | null = null;
  private ended = false;
  private newest: RecordingProgress | null = null;
  private growing = false;

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
    socket.onmessage = (event) => this.hear(JSON.parse(String(event.data)) as RecordingProgress | PageNote);
    socket.onclose = () => {
      if (!this.ended && this.match.grows()) setTimeout(() => this.ended || this.connect(), AGAIN_S * 1000);
    };
  }

  private hear(told: RecordingProgress | PageNote): void {
    if (told.kind === "note") note.value = told;
    else {
      this.newest = told;
      if (!this.growing) void this.grow();
    }
  }

  /** Take what is new, one look after the other; of the progress that is told meanwhile only the newest counts. */
  private async grow(): Promise<void> {
    this.growing = true;
    while (this.newest && !this.ended) {
      const progress = this.newest;
      this.newest = null;
      await this.match.grow(progress).catch(() => undefined); // the next progress tries again
      await new Promise((rest) => setTimeout(rest, REST_S * 1000));
    }
    this.growing = false;
  }
}
