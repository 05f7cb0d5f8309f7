/** The page: a match, two of them, an experiment, or the library. */

import { useEffect } from "preact/hooks";
import { Advice } from "./Advice";
import { Agents } from "./agents/Agents";
import { Compare } from "./compare/Compare";
import { Help } from "./Help";
import { writeHash } from "./hash";
import { helpOpen } from "./keys";
import { Experiment } from "./library/Experiment";
import { Library } from "./library/Library";
import { MapView } from "./map/MapView";
import type { Match } from "./match";
import { Score } from "./Score";
import { link, lives, matches } from "./stage";
import { theme, toggleTheme } from "./theme";
import { Controls } from "./timeline/Controls";
import { Plots } from "./timeline/Plots";

export function App() {
  const [a, b] = matches.value;
  const title = a?.run.value ? titleOf(a) : "";
  useEffect(() => void (document.title = title ? `${title} · Khala` : "Khala"), [title]);
  return (
    <>
      <Bar match={a} other={b} />
      {!a && (link.value.x ? <Experiment key={link.value.x} id={link.value.x} /> : <Library />)}
      {a && (b ? <Compare a={a} b={b} /> : <One match={a} />)}
      {a && (
        <footer class="foot" aria-label="Time">
          <Controls matches={matches.value} />
          <Plots matches={matches.value} />
        </footer>
      )}
      {helpOpen.value && <Help />}
    </>
  );
}

function Bar({ match, other }: { match: Match | undefined; other: Match | undefined }) {
  const episodes = match?.run.value?.episodes ?? [];
  return (
    <nav class="bar" aria-label="Khala">
      <a href="#" class="home">
        Khala
      </a>
      {match && <h1 class="title">{[match, other].map((m) => m?.run.value && titleOf(m)).filter(Boolean).join("  |  ")}</h1>}
      {match && !other && episodes.length > 1 && (
        <select aria-label="Episode" value={match.episode} onChange={(e) => (location.hash = writeHash({ a: match.id, e: Number(e.currentTarget.value) }))}>
          {episodes.map((e) => (
            <option value={e.episode}>
              Episode {e.episode + 1} {Object.values(e.outcomes)[0] ?? ""}
            </option>
          ))}
        </select>
      )}
      <span class="spring" />
      <button onClick={toggleTheme} aria-label={`Change to ${theme.value === "dark" ? "light" : "dark"}`} title="Light or dark">
        {theme.value === "dark" ? "☀" : "☾"}
      </button>
      <button onClick={() => (helpOpen.value = true)} aria-label="Help" title="Keys and signs (?)">
        ?
      </button>
    </nav>
  );
}

const titleOf = (match: Match) => {
  const line = match.run.value!.line;
  return `${line.task} on ${line.map}, seed ${line.seed}`;
};

function One({ match }: { match: Match }) {
  const [live] = lives.value;
  return (
    <main class="one" data-moment={match.moment.value?.step}>
      <Score match={match} />
      <MapView key={`${match.id}/${match.episode}`} match={match} />
      <Agents match={match} />
      {match.run.value?.can_advise && live && <Advice match={match} live={live} />}
    </main>
  );
}
