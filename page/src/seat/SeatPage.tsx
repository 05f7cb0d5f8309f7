/** The page of a person who plays: what its agent is told, and what it may do, under the same clock. */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { address } from "../api";
import { alongReferences, Words } from "../agents/Words";
import { theme, toggleTheme } from "../theme";
import { spaced, whole } from "../words";
import type { SeatQuestion, SeatResult } from "../wire";
import { Countdown } from "./Countdown";
import { HINTS, keyOf, listen } from "./keys";
import { question as asks, SCREEN } from "./picking";
import * as seat from "./seat";
import { SeatMap } from "./SeatMap";

export function SeatPage() {
  const asked = seat.question.value;
  const mine = seat.state.value?.mine ?? false;
  useEffect(listen, []);
  useEffect(() => void (document.title = `${seat.state.value?.waits ? "Your turn · " : ""}${seat.briefing.value?.agent ?? "Seat"} · Khala`));
  return (
    <>
      <Bar />
      <Standing />
      <main class="seat">
        {asked && <SeatMap asked={asked} />}
        {asked && (
          <section class="seat-orders" aria-label="Orders">
            {mine && <Orders asked={asked} />}
            <Draft asked={asked} mine={mine} />
          </section>
        )}
        <section class="seat-told" aria-label="What you are told">
          {asked && <Fates asked={asked} />}
          <Letters mine={mine} />
          {asked && <Observation asked={asked} />}
          {seat.briefing.value && (
            <details>
              <summary>Briefing: who you are, all your actions, an example</summary>
              <pre class="long" tabIndex={0}>
                {seat.briefing.value.text}
              </pre>
            </details>
          )}
          <details>
            <summary>Keys</summary>
            <dl class="facts">
              {HINTS.map(([keys, does]) => (
                <>
                  <dt>
                    <kbd>{keys}</kbd>
                  </dt>
                  <dd>{does}</dd>
                </>
              ))}
            </dl>
          </details>
        </section>
      </main>
    </>
  );
}

function Bar() {
  const about = seat.briefing.value;
  return (
    <nav class="bar" aria-label="Khala">
      <span class="home">Khala</span>
      <h1 class="title">{about ? `You are ${about.agent} of ${about.side}, episode ${about.episode + 1} of ${about.episodes}` : "A seat in a match"}</h1>
      <span class="spring" />
      <button onClick={toggleTheme} aria-label={`Change to ${theme.value === "dark" ? "light" : "dark"}`} title="Light or dark">
        {theme.value === "dark" ? "☀" : "☾"}
      </button>
    </nav>
  );
}

/** How the seat is: whose turn it is, for how long, and how episodes ended. */
function Standing() {
  const state = seat.state.value;
  const waits = state?.waits && state.mine;
  return (
    <header class={`seat-standing ${waits ? "is-asked" : ""}`}>
      <p role="status">{words()}</p>
      {waits && <Countdown />}
      {state && !state.mine && !state.over && <button onClick={seat.take}>Play here</button>}
      {state?.results.map((result) => <Result key={result.episode} result={result} />)}
    </header>
  );
}

function words(): string {
  const state = seat.state.value;
  const asked = seat.question.value;
  if (state?.over) return "The match is over. Thank you for playing.";
  if (!seat.connected.value) return "There is no connection. It is tried again; your draft is kept.";
  if (!state) return "Connecting…";
  if (!state.mine) return "Another window plays this seat.";
  if (!asked) return "The match begins when all have come.";
  if (state.waits) return `Your turn: step ${asked.step}`;
  if (state.sent !== null) return `Your answer to step ${asked.step} is sent.`;
  return `Step ${asked.step} went on without your answer.`;
}

function Result({ result }: { result: SeatResult }) {
  return (
    <p class="seat-result">
      <strong>{`Episode ${result.episode + 1}: ${result.ending}.`}</strong> {`Killed ${whole(result.killed)}, lost ${whole(result.lost)}.`} {!result.valid && <span class="warn">{`Not valid: ${result.invalid_because}`}</span>}
    </p>
  );
}

/** Teams, their actions, and what an action may aim at. */
function Orders({ asked }: { asked: SeatQuestion }) {
  const now = seat.team.value;
  const open = seat.picking.value;
  return (
    <>
      <div class="seat-row" role="group" aria-label="Teams">
        {asked.view.teams.map((team, i) => (
          <button key={team.name} aria-pressed={team.name === now?.name} onClick={() => seat.chooseTeam(team.name)}>
            {i < 9 && !open && <kbd aria-hidden="true">{i + 1}</kbd>} {team.name} <span class="muted">{team.units.length || ""}</span>
          </button>
        ))}
      </div>
      {now && (
        <div class="seat-row" role="group" aria-label={`Actions of ${now.name}`}>
          {now.actions.map((action) => (
            <button key={action.name} title={action.description} aria-pressed={open?.action.name === action.name} onClick={() => seat.choose(action)}>
              {keyOf(action) && <kbd aria-hidden="true">{keyOf(action)}</kbd>} {spaced(action.name)}
            </button>
          ))}
        </div>
      )}
      {open && (
        <div class="seat-row seat-offers" role="group" aria-label="Targets">
          <p role="status">
            {spaced(open.action.name)}: <strong>{asks(open)}?</strong> Pick it on the map{seat.offers.value.length > 0 && " or here"}.
          </p>
          {seat.offers.value.map((one, i) => (
            <button key={String(one.argument)} onClick={() => seat.pick(one.argument)}>
              {i < 9 && <kbd aria-hidden="true">{i + 1}</kbd>} {one.name}
            </button>
          ))}
          <button onClick={() => (seat.picking.value = null)}>
            <kbd aria-hidden="true">esc</kbd> Cancel
          </button>
        </div>
      )}
    </>
  );
}

/** The answer as it will be sent, and the one that was sent. */
function Draft({ asked, mine }: { asked: SeatQuestion; mine: boolean }) {
  const state = seat.state.value;
  const ready = mine && state?.waits && !seat.sending.value;
  const empty = !seat.draft.value.trim();
  return (
    <form
      class="seat-draft"
      onSubmit={(event) => {
        event.preventDefault();
        seat.send();
      }}
    >
      <label for="draft">Your answer, word for word as an agent sends it</label>
      <textarea id="draft" rows={7} spellcheck={false} readOnly={!mine} value={seat.draft.value} placeholder={"Actions:\n    Team …:\n        <…>"} onInput={(event) => (seat.draft.value = event.currentTarget.value)} />
      <div class="seat-row seat-send">
        <button class="primary" disabled={!ready}>
          {seat.sending.value ? "Sending…" : empty ? "Carry on without orders" : `Send for step ${asked.step}`}
        </button>
        <button type="button" disabled={!mine || !seat.canUndo.value} onClick={seat.undo}>
          Undo
        </button>
        <button type="button" disabled={!mine || !seat.lastSent.value} onClick={() => seat.write(seat.lastSent.value)}>
          Same as before
        </button>
      </div>
      {seat.note.value && (
        <output class={seat.note.value.ok ? "good" : "bad"} role="status">
          {seat.note.value.text}
        </output>
      )}
    </form>
  );
}

/** What became of the answer before. */
function Fates({ asked }: { asked: SeatQuestion }) {
  if (!asked.accepted.length && !asked.rejections.length) return null;
  return (
    <section aria-label="What became of your last answer">
      <h2>Your last answer</h2>
      <ul class="deeds">
        {asked.accepted.map((call, i) => (
          <li key={i} class="deed">
            <span class="sign" role="img" aria-label="accepted">
              ✓
            </span>
            <code>{call}</code>
          </li>
        ))}
        {asked.rejections.map((no, i) => (
          <li key={i} class="deed refused">
            <span class="sign" role="img" aria-label="refused">
              ✗
            </span>
            <code>{no.text || "…"}</code>
            <p class="reason">
              <strong>{spaced(no.reason)}: </strong>
              {no.message}
            </p>
          </li>
        ))}
      </ul>
    </section>
  );
}

/** What other agents wrote, and a line to write to them: it goes out with the answer. */
function Letters({ mine }: { mine: boolean }) {
  const about = seat.briefing.value;
  const to = useSignal("");
  const text = useSignal("");
  const known = [...(about?.correspondents ?? []), ...(about?.channels ?? [])];
  if (!known.length && !seat.letters.value.length) return null;
  const add = (event: Event) => {
    event.preventDefault();
    if (!text.value.trim()) return;
    seat.tell(to.value || known[0], text.value);
    text.value = "";
  };
  return (
    <section aria-label="Messages">
      <h2>Messages</h2>
      <ol class="seat-letters" aria-live="polite">
        {seat.letters.value.map((letter, i) => (
          <li key={i} class="letter">
            <span class="who">{`${letter.from}${letter.to === about?.agent ? "" : ` in ${letter.to}`}, step ${letter.step}: `}</span>
            <Words text={letter.text} frame="minimap" />
          </li>
        ))}
      </ol>
      {mine && known.length > 0 && (
        <form class="seat-row" onSubmit={add}>
          <select aria-label="Recipient" value={to.value || known[0]} onChange={(event) => (to.value = event.currentTarget.value)}>
            {known.map((name) => (
              <option>{name}</option>
            ))}
          </select>
          <input aria-label="Message" placeholder="They read it with their next observation" value={text.value} onInput={(event) => (text.value = event.currentTarget.value)} />
          <button disabled={!text.value.trim()}>Add to the answer</button>
        </form>
      )}
    </section>
  );
}

/** The observation, word for word and picture for picture. */
function Observation({ asked }: { asked: SeatQuestion }) {
  const screens = asked.view.teams.map((team) => ({ name: team.name, minimap: team.minimap, screen: SCREEN / asked.view.cell }));
  return (
    <section aria-label="Observation">
      <h2>{`Observation of step ${asked.step}`}</h2>
      {asked.images.map((image) => (
        <figure key={image.sha256}>
          <img src={address(`images/${image.sha256}`)} alt={image.title || image.name} width={image.width} height={image.height} />
          <figcaption>{image.title || image.name}</figcaption>
        </figure>
      ))}
      <pre class="long" onKeyDown={alongReferences} tabIndex={0} aria-label="Observation; arrow keys go from unit to unit">
        <Words text={asked.text} screens={screens} quiet />
      </pre>
    </section>
  );
}

