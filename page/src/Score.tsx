/** Who plays, with which models, and who is winning: the head of a match. */

import type { Match } from "./match";
import { OPPONENT } from "./match";
import { result, standings, story, type Standing } from "./standing";
import { capital, ratio, whole } from "./words";

export function Score({ match, name = "" }: { match: Match; name?: string }) {
  const run = match.run.value;
  if (!run) return <header class="score">{match.trouble.value ? <p class="bad">{match.trouble.value}</p> : <p class="muted">Loading…</p>}</header>;
  const [a, b] = standings(match);
  const end = result(match);
  return (
    <header class="score" aria-label="Score">
      <Player match={match} side={a} tint={0} name={name} />
      {b && <Balance a={a} b={b} />}
      {b && <Player match={match} side={b} tint={1} name="" />}
      <p class="story">
        <span>{b ? story(a, b) : ""}</span>
        {end && <strong class={`result ${end.winner >= 0 ? `side-${end.winner}` : ""}`}>{end.text}</strong>}
        {run.line.live && <strong class="result live"><span class="live-dot" /> Live{match.lag.value !== null && `, ${match.lag.value.toFixed(1)} s behind`}</strong>}
        {!run.line.valid && <strong class="result bad">not valid</strong>}
        {run.indexed < 1 && <span class="muted">{`${Math.floor(run.indexed * 100)}% is read`}</span>}
      </p>
      {match.trouble.value && <p class="bad">{match.trouble.value}</p>}
    </header>
  );
}

function Player({ match, side, tint, name }: { match: Match; side: Standing; tint: number; name: string }) {
  const run = match.run.value!;
  const agents = run.agents.filter((agent) => agent.side === side.side);
  const models = [...new Set(agents.map((agent) => agent.model).filter(Boolean))];
  const who = side.side === OPPONENT ? run.line.opponent || "the opponent" : models.join(", ") || run.line.models.join(", ") || "agents";
  const names = agents.map((agent) => agent.name).join(", ");
  return (
    <div class={`player tint-${tint}`}>
      <h2>
        {name && <b class="which">{name}</b>}
        <span class="dot" /> {capital(side.side)}
      </h2>
      <p class="who" title={`${who} ${names}`}>
        {who}
        {names && <span class="muted"> · {names}</span>}
      </p>
    </div>
  );
}

/** The numbers of both sides against each other, and the armies as a bar. */
function Balance({ a, b }: { a: Standing; b: Standing }) {
  const sum = (a.army ?? 0) + (b.army ?? 0);
  const part = sum > 0 ? (a.army ?? 0) / sum : 0.5;
  const rows: [string, string, string, string][] = [
    ["Army value", whole(a.army), whole(b.army), "Minerals and vespene of the army"],
    ["Workers", whole(a.workers), whole(b.workers), "Workers"],
    ["K/D", ratio(a.killed ?? 0, a.lost ?? 0), ratio(b.killed ?? 0, b.lost ?? 0), "Value destroyed for each that was lost"],
  ];
  return (
    <div class="balance">
      <div class="numbers">
        {rows.map(([name, left, right, title]) => (
          <span key={name} title={title}>
            <b class="side-0">{left}</b> <i>{name}</i> <b class="side-1">{right}</b>
          </span>
        ))}
      </div>
      <div class="bar" role="img" aria-label={`Army value ${whole(a.army)} to ${whole(b.army)}`}>
        <span class="fill-0" style={{ width: `${part * 100}%` }} />
        <span class="fill-1" style={{ width: `${(1 - part) * 100}%` }} />
      </div>
    </div>
  );
}
