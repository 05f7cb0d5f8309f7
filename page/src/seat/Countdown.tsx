/** The time that is left for an answer. */

import { useEffect, useState } from "preact/hooks";
import { deadline, question, state } from "./seat";

/** From here on the time is short. */
const SHORT_S = 5;
const TICK_MS = 200;

export function Countdown() {
  const [now, setNow] = useState(performance.now());
  useEffect(() => {
    const ticking = setInterval(() => setNow(performance.now()), TICK_MS);
    return () => clearInterval(ticking);
  }, []);
  if (!state.value?.waits) return null;
  const end = deadline.value;
  if (end === null) return <p class="muted">The game waits for you.</p>;
  const left = Math.max(0, (end - now) / 1000);
  return (
    <p class={`seat-time ${left < SHORT_S ? "is-short" : ""}`}>
      <span role="timer">{left < SHORT_S ? left.toFixed(1) : Math.ceil(left)} s left</span>
      <progress aria-label="Time left" max={question.value?.time_s ?? left} value={left} />
    </p>
  );
}
