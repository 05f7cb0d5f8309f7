/** An experiment's table: each number with its interval as a bar; a row leads to its matches. */

import { useSignal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { get } from "../api";
import { still } from "../theme";
import type { TableCell, ExperimentView, TableRow } from "../wire";
import { RunTable } from "./RunTable";

export function Experiment({ id }: { id: string }) {
  const [view, setView] = useState<ExperimentView | null>(null);
  const [trouble, setTrouble] = useState("");
  const chosen = useSignal(-1);
  const matches = useRef<HTMLHeadingElement>(null);
  const choose = (i: number) => {
    chosen.value = i === chosen.value ? -1 : i;
    if (chosen.value >= 0) matches.current?.scrollIntoView({ behavior: still ? "auto" : "smooth" });
  };
  useEffect(() => void get<ExperimentView>(`experiments/${id}`).then(setView, (error: Error) => setTrouble(error.message)), [id]);
  if (!view) return <main class="library">{trouble ? <p class="bad">{trouble}</p> : <p class="muted">Loading…</p>}</main>;
  const ranges = view.columns.map((_, i) => rangeOf(view.rows.map((row) => row.cells[i])));
  const row = view.rows[chosen.value];
  const runs = row ? view.runs.filter((run) => row.runs.includes(run.id)) : view.runs;
  return (
    <main class="library">
      <h1>{view.line.name}</h1>
      <p>{view.line.description}</p>
      <div class="table-box" tabIndex={0} role="region" aria-label="Table">
        <table>
          <thead>
            <tr>
              {[...view.factors, ...view.columns].map((name) => (
                <th key={name}>{name}</th>
              ))}
            </tr>
          </thead>
          <tbody>
            {view.rows.map((r, i) => (
              <RowView key={i} row={r} ranges={ranges} chosen={i === chosen.value} choose={() => choose(i)} />
            ))}
          </tbody>
        </table>
      </div>
      <ul class="notes">
        {view.notes.map((words) => (
          <li key={words}>{words}</li>
        ))}
      </ul>
      <h2 ref={matches}>{row ? `Matches of ${row.names.join(", ")}` : "Matches"}</h2>
      <RunTable runs={runs} />
    </main>
  );
}

function RowView({ row, ranges, chosen, choose }: { row: TableRow; ranges: readonly Range[]; chosen: boolean; choose: () => void }) {
  return (
    <tr class={chosen ? "is-chosen" : ""}>
      {row.names.map((name, i) => (
        <td key={i}>
          {i === 0 ? (
            <button class="link" aria-pressed={chosen} onClick={choose} title="Show its matches">
              {name}
            </button>
          ) : (
            name
          )}
        </td>
      ))}
      {row.cells.map((cell, i) => (
        <td key={i}>
          {cell.text}
          <Interval cell={cell} range={ranges[i]} />
        </td>
      ))}
    </tr>
  );
}

type Range = readonly [number, number];

/** The part of all ends of intervals that a column shows: one K/D of 70 would make all others a dot. */
const SHOWN = 0.9;

/** Return the range that the bars of a column show, from 0 on. */
function rangeOf(cells: readonly TableCell[]): Range {
  const ends = cells.flatMap((c) => [c?.low, c?.value, c?.high]).filter((v): v is number => typeof v === "number");
  const sorted = ends.sort((a, b) => a - b);
  return [Math.min(0, ...ends), Math.max(1e-9, sorted[Math.floor((sorted.length - 1) * SHOWN)] ?? 0)];
}

function Interval({ cell, range }: { cell: TableCell; range: Range }) {
  if (cell.value === null) return null;
  const part = (value: number) => ((value - range[0]) / (range[1] - range[0])) * 100;
  const [low, high] = [cell.low ?? cell.value, cell.high ?? cell.value];
  return (
    <div class="interval" aria-hidden="true">
      <span style={{ left: `${part(low)}%`, width: `${Math.max(part(high) - part(low), 0.5)}%` }} />
      <i style={{ left: `${part(cell.value)}%` }} />
    </div>
  );
}
