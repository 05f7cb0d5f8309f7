/** All agents of a match in a row, each with what became of its last decision: a click opens and chooses one. */

import { keyOf, type Match } from "../match";
import { agent } from "../stage";
import type { SeenDecision } from "../wire";

export function Strip({ match, open }: { match: Match; open: (key: string) => void }) {
  return (
    <div class="strip" role="group" aria-label="All agents">
      {match.agents.value.map((line) => {
        const key = keyOf(line);
        const decision = match.decisions.value.get(key);
        const side = Math.min(Math.max(match.sides.value.indexOf(line.side), 0), 1);
        const choose = () => {
          agent.value = agent.value === key ? "" : key;
          open(key);
        };
        return (
          <button key={key} class={`tint-${side}`} aria-pressed={agent.value === key} onClick={choose} title={told(decision)}>
            <span class="dot" /> {line.name} <Fates decision={decision} />
          </button>
        );
      })}
    </div>
  );
}

function Fates({ decision }: { decision: SeenDecision | undefined }) {
  const [accepted, refused] = counts(decision);
  return (
    <>
      {accepted > 0 && <span class="good">✓{accepted}</span>}
      {refused > 0 && <span class="bad">✗{refused}</span>}
      {decision?.status && decision.status !== "ok" && <span class="bad">{decision.status}</span>}
    </>
  );
}

const counts = (decision: SeenDecision | undefined) => [true, false].map((accepted) => (decision?.deeds ?? []).filter((deed) => deed.accepted === accepted).length);

function told(decision: SeenDecision | undefined): string {
  if (!decision) return "It has not been asked yet";
  const [accepted, refused] = counts(decision);
  return `Of its last decision ${accepted} actions were accepted and ${refused} refused`;
}
