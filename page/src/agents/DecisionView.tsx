/** A decision in the order in which it came about: read, thought, asked for, wrote. */

import type { ComponentChildren } from "preact";
import { capital, spaced } from "../words";
import type { SeenDecision, Deed, Letter } from "../wire";
import { Words, pointAt, pointAway } from "./Words";

export function DecisionView({ decision }: { decision: SeenDecision }) {
  const { read, thought, deeds, sent, teams } = decision;
  return (
    <>
      {read.length > 0 && (
        <Part name="Read">
          {read.map((letter, i) => (
            <LetterView key={i} letter={letter} who={`from ${letter.sender}`} />
          ))}
        </Part>
      )}
      <Part name="Thought">
        <p class="thought">{thought ? <Words text={thought} screens={teams} /> : <span class="muted">Nothing was written.</span>}</p>
      </Part>
      <Part name="Asked for">
        {deeds.length === 0 && <p class="muted">No action.</p>}
        <ul class="deeds">
          {byTeam(deeds).map(([team, its]) => (
            <li key={team}>
              {team && <h4>{team}</h4>}
              <ul>
                {its.map((deed) => (
                  <DeedView key={deed.start} deed={deed} decision={decision} />
                ))}
              </ul>
            </li>
          ))}
        </ul>
      </Part>
      {sent.length > 0 && (
        <Part name="Wrote">
          {sent.map((letter, i) => (
            <LetterView key={i} letter={letter} who={`to ${letter.recipient}`} />
          ))}
        </Part>
      )}
    </>
  );
}

function Part({ name, children }: { name: string; children: ComponentChildren }) {
  return (
    <div class="part">
      <h3>{name}</h3>
      {children}
    </div>
  );
}

const SIGNS = { true: ["✓", "accepted"], false: ["✗", "refused"], null: ["…", "not carried out yet"] } as const;

function DeedView({ deed, decision }: { deed: Deed; decision: SeenDecision }) {
  const [sign, meaning] = SIGNS[String(deed.accepted) as keyof typeof SIGNS];
  const point = () => pointAt(deed.tags, deed.at ? [deed.at] : []);
  const stale = decision.fate === "stale" || decision.fate === "adapted";
  return (
    <li class={`deed ${{ true: "", false: "refused", null: "open" }[String(deed.accepted) as keyof typeof SIGNS]}`} onPointerEnter={point} onPointerLeave={pointAway}>
      <span class="sign" role="img" aria-label={meaning} title={meaning}>
        {sign}
      </span>
      <code>
        <Words text={deed.text} screens={decision.teams.filter((t) => !deed.team || t.name === deed.team)} />
      </code>
      {stale && deed.accepted && <span class="badge warn">{`${capital(decision.fate ?? "")} by ${decision.age_loops} loops`}</span>}
      {deed.accepted === false && (
        <p class="reason">
          {deed.reason && <strong>{spaced(deed.reason)}: </strong>}
          {deed.message}
        </p>
      )}
    </li>
  );
}

export function LetterView({ letter, who }: { letter: Letter; who: string }) {
  return (
    <p class={`letter ${letter.human ? "human" : ""}`}>
      <span class="who">
        {who}
        {letter.human && <span class="badge warn">human</span>}
        {letter.again && " (again)"}
      </span>{" "}
      <Words text={letter.text} frame="minimap" />
    </p>
  );
}

function byTeam(deeds: readonly Deed[]): [string, Deed[]][] {
  const teams = new Map<string, Deed[]>();
  for (const deed of deeds) teams.set(deed.team, [...(teams.get(deed.team) ?? []), deed]);
  return [...teams];
}
