/** Two matches side by side on one clock, with what differs between them. */

import * as clock from "../clock";
import { DecisionView } from "../agents/DecisionView";
import { MapView } from "../map/MapView";
import type { Match } from "../match";
import { Score } from "../Score";
import { clockText } from "../time";
import { capital } from "../words";
import { differences, divergence, sameDeeds, type Difference } from "./differences";

export function Compare({ a, b }: { a: Match; b: Match }) {
  return (
    <main class="compare">
      <div class="pair">
        {[a, b].map((match, i) => (
          <div class="half" key={i}>
            <Score match={match} name={"AB"[i]} />
            <MapView match={match} name={"AB"[i]} />
          </div>
        ))}
      </div>
      <section class="differences" aria-label="Differences">
        <Begins a={a} b={b} />
        <Values a={a} b={b} />
        <Decisions a={a} b={b} />
      </section>
    </main>
  );
}

function Begins({ a, b }: { a: Match; b: Match }) {
  const [first, second] = [a.timeline.value, b.timeline.value];
  if (!first || !second) return null;
  const index = divergence(first, second);
  if (index === null) return <p>The two matches are the same in all that is counted.</p>;
  const moment = (clock.axis.value === "time" ? first.time_s : first.steps)[Math.min(index, first.steps.length - 1)];
  return (
    <p>
      They differ from step {index} on.{" "}
      <button onClick={() => clock.go(moment)}>{`Go to ${clockText(first.time_s[Math.min(index, first.steps.length - 1)])}`}</button>
    </p>
  );
}

function Values({ a, b }: { a: Match; b: Match }) {
  return (
    <table class="values">
      <thead>
        <tr>
          <th>At this moment</th>
          <th>A</th>
          <th>B</th>
          <th>B − A</th>
        </tr>
      </thead>
      <tbody>
        {differences(a, b).map((d) => (
          <tr key={`${d.name} ${d.side}`} class={d.a !== d.b ? "differs" : ""}>
            <th>
              {d.name} {d.side && <span class="muted">{capital(d.side)}</span>}
            </th>
            <td>{d.write(d.a)}</td>
            <td>{d.write(d.b)}</td>
            <td>{gap(d)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

function gap({ a, b, write }: Difference): string {
  if (a === null || b === null || a === b) return "";
  return `${b > a ? "+" : "−"}${write(Math.abs(b - a))}`;
}

function Decisions({ a, b }: { a: Match; b: Match }) {
  const keys = [...new Set([...a.decisions.value.keys(), ...b.decisions.value.keys()])];
  return (
    <div class="decision-pairs">
      {keys.map((key) => {
        const [first, second] = [a.decisions.value.get(key), b.decisions.value.get(key)];
        const same = sameDeeds(first, second);
        return (
          <details key={key} open={!same}>
            <summary>
              {key} <span class={`badge ${same ? "" : "warn"}`}>{same ? "asks for the same" : "differs"}</span>
            </summary>
            <div class="decision-pair">
              {[first, second].map((d, i) => (
                <div key={i}>
                  <h3>{"AB"[i]}</h3>
                  {d ? <DecisionView decision={d} /> : <p class="muted">Not asked yet.</p>}
                </div>
              ))}
            </div>
          </details>
        );
      })}
    </div>
  );
}
