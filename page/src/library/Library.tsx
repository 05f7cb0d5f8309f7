/** The list of what can be opened: recordings with a filter, and experiments. */

import { signal, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { get } from "../api";
import { writeHash } from "../hash";
import { whole } from "../words";
import type { Library as LibraryAnswer } from "../wire";
import { matching } from "./filter";
import { RunTable } from "./RunTable";

export const library = signal<LibraryAnswer | null>(null);
const trouble = signal("");

/** Ask for the library; what was asked for on the command line is opened at once. */
export async function loadLibrary(): Promise<LibraryAnswer | null> {
  try {
    return (library.value = await get<LibraryAnswer>("library"));
  } catch (error) {
    trouble.value = (error as Error).message;
    return null;
  }
}

export function Library() {
  const filter = useSignal("");
  useEffect(() => void loadLibrary(), []);
  const answer = library.value;
  if (!answer) return <main class="library">{trouble.value ? <p class="bad">{trouble.value}</p> : <p class="muted">Loading…</p>}</main>;
  const runs = matching(answer.runs, filter.value);
  return (
    <main class="library">
      <h1>{answer.title}</h1>
      {answer.experiments.length > 0 && (
        <section>
          <h2>Experiments</h2>
          <ul class="cards">
            {answer.experiments.map((e) => (
              <li key={e.id}>
                <a href={writeHash({ x: e.id })}>{e.name}</a>
                <p>{e.description}</p>
                <progress max={Math.max(1, e.matches)} value={e.played} aria-label="Played" />
                <span class="muted">
                  {e.played} of {whole(e.matches)} matches played
                </span>
              </li>
            ))}
          </ul>
        </section>
      )}
      <section>
        <h2>Matches</h2>
        <label class="filter">
          Filter
          <input type="search" value={filter.value} onInput={(e) => (filter.value = e.currentTarget.value)} placeholder="words that a match must have: task, map, model, win, label…" />
          <span class="muted" role="status">
            {runs.length} of {answer.runs.length}
          </span>
        </label>
        <RunTable runs={runs} />
      </section>
    </main>
  );
}
