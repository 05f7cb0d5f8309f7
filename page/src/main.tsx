import { render } from "preact";
import type { ComponentChild } from "preact";
import { keepLit } from "./agents/lit";
import { App } from "./App";
import { writeHash } from "./hash";
import { listenToKeys } from "./keys";
import { loadLibrary } from "./library/Library";
import { begin as takeSeat, isSeat } from "./seat/seat";
import { SeatPage } from "./seat/SeatPage";
import { begin } from "./stage";
import "./style/page.css";

/** What was asked for on the command line is what a page without a link begins with. */
async function start(): Promise<void> {
  if (isSeat(location.pathname)) {
    takeSeat();
    return show(<SeatPage />);
  }
  if (!location.hash) {
    const [a, b] = (await loadLibrary())?.opened ?? [];
    if (a) history.replaceState(null, "", writeHash({ a, b }));
  }
  begin();
  keepLit();
  listenToKeys();
  show(<App />);
}

function show(what: ComponentChild): void {
  const page = document.getElementById("page")!;
  page.replaceChildren();
  render(what, page);
}

void start();
