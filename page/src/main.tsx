import { render } from "preact";
import { keepLit } from "./agents/lit";
import { App } from "./App";
import { writeHash } from "./hash";
import { listenToKeys } from "./keys";
import { loadLibrary } from "./library/Library";
import { begin } from "./stage";
import "./style/page.css";

/** What was asked for on the command line is what a page without a link begins with. */
async function start(): Promise<void> {
  if (!location.hash) {
    const [a, b] = (await loadLibrary())?.opened ?? [];
    if (a) history.replaceState(null, "", writeHash({ a, b }));
  }
  begin();
  keepLit();
  listenToKeys();
  const page = document.getElementById("page")!;
  page.replaceChildren();
  render(<App />, page);
}

void start();
