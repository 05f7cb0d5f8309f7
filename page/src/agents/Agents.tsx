/** The agents of a match beside the map: a column each, their messages, and what happened. */

import { signal } from "@preact/signals";
import { keyOf, type Match } from "../match";
import { agent } from "../stage";
import { Tabs } from "../Tabs";
import { AgentColumn } from "./AgentColumn";
import { Card } from "./Card";
import { Happenings } from "./Happenings";
import { Strip } from "./Strip";
import { Threads } from "./Threads";

/** Columns that are open at first; of more agents a row of all of them is shown above. */
const OPEN_AT_FIRST = 4;

const view = signal("agents");
const opened = signal<Readonly<Record<string, boolean>>>({});

const VIEWS = [
  { id: "agents", name: "Agents" },
  { id: "threads", name: "Messages" },
  { id: "happenings", name: "What happened" },
  { id: "card", name: "Run card" },
];

export function Agents({ match }: { match: Match }) {
  return (
    <section class="agents" aria-label="Agents">
      <Tabs label="Beside the map" tabs={VIEWS} chosen={view.value} choose={(id) => (view.value = id)} panel="beside" />
      <div id="beside" class={`beside ${view.value}`} role="tabpanel" aria-labelledby={`beside-${view.value}`}>
        {view.value === "agents" && <Columns match={match} />}
        {view.value === "threads" && <Threads match={match} />}
        {view.value === "happenings" && <Happenings match={match} />}
        {view.value === "card" && <Card match={match} />}
      </div>
    </section>
  );
}

function Columns({ match }: { match: Match }) {
  const lines = match.agents.value;
  if (!lines.length) return <p class="muted pad">No agents are known.</p>;
  const set = (key: string, open: boolean) => {
    opened.value = { ...opened.value, [key]: open };
    if (!open && agent.value === key) agent.value = "";
  };
  return (
    <>
      {lines.length > OPEN_AT_FIRST && <Strip match={match} open={(key) => set(key, true)} />}
      <div class="columns">
        {lines.map((line, i) => {
          const key = keyOf(line);
          const open = agent.value === key || (opened.value[key] ?? i < OPEN_AT_FIRST);
          return <AgentColumn key={`${match.id}/${key}`} match={match} line={line} open={open} toggle={() => set(key, !open)} />;
        })}
      </div>
    </>
  );
}
