/** Advice of a person to the agents of a match that is being played. */

import { useSignal } from "@preact/signals";
import { note, type Live } from "./live";
import type { Match } from "./match";
import { capital } from "./words";

const MOST_CHARACTERS = 500;

export function Advice({ match, live }: { match: Match; live: Live }) {
  const to = useSignal("everyone");
  const side = useSignal(match.run.value?.sides[0] ?? "");
  const text = useSignal("");
  const send = (event: Event) => {
    event.preventDefault();
    live.advise({ side: side.value, recipient: to.value, text: text.value.trim() });
    text.value = "";
  };
  const sides = match.run.value?.sides ?? [];
  return (
    <form class="advice" onSubmit={send}>
      <strong>Advise</strong>
      {sides.length > 1 && (
        <select aria-label="Side" value={side.value} onChange={(e) => (side.value = e.currentTarget.value)}>
          {sides.map((s) => (
            <option value={s}>{capital(s)}</option>
          ))}
        </select>
      )}
      <select aria-label="Recipient" value={to.value} onChange={(e) => (to.value = e.currentTarget.value)}>
        <option value="everyone">everyone</option>
        {match.agents.value.filter((a) => a.side === side.value).map((a) => (
          <option>{a.name}</option>
        ))}
      </select>
      <input
        aria-label="Advice"
        placeholder="What would you tell them? They read it with their next observation, marked as from a human."
        maxLength={MOST_CHARACTERS}
        value={text.value}
        onInput={(e) => (text.value = e.currentTarget.value)}
        required
      />
      <span class="muted">
        {text.value.length}/{MOST_CHARACTERS}
      </span>
      <button disabled={!text.value.trim()}>Send</button>
      {note.value && (
        <output class={note.value.ok ? "good" : "bad"} role="status">
          {note.value.text}
        </output>
      )}
    </form>
  );
}
