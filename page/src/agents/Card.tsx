/** The run card as it was recorded, and how the map of this recording was made. */

import type { Match } from "../match";
import { bytes, count } from "../words";

const SCENES = {
  whole: "The map is drawn from scenes without fog.",
  seen: "The map is drawn from what the sides saw together: the game gave no scene without fog.",
  views: "This recording has no scenes: the map is drawn from what the agents were shown, and knows no more.",
} as const;

export function Card({ match }: { match: Match }) {
  const run = match.run.value;
  if (!run) return null;
  const { line } = run;
  return (
    <div class="list-view">
      <p>
        {line.path}: {count(line.steps, "step")}, {bytes(line.size_bytes)}. {SCENES[run.scenes]}
        {!line.complete && " The recording is not complete."}
      </p>
      {match.line.value?.invalid_because && <p class="bad">{`Not valid: ${match.line.value.invalid_because}`}</p>}
      <pre class="long">{JSON.stringify(run.card, null, 2)}</pre>
    </div>
  );
}
