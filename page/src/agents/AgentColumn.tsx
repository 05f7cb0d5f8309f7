/** One agent at the moment: what it read, thought, asked for and wrote, and what became of it. */

import { useSignal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { keyOf, type Match } from "../match";
import { agent } from "../stage";
import { Tabs } from "../Tabs";
import { capital, dollars, seconds, short, spaced } from "../words";
import type { AgentLine, DecisionTexts, SeenDecision } from "../wire";
import { DecisionView } from "./DecisionView";
import { Observation } from "./Observation";
import { Requests } from "./Requests";
import { Words } from "./Words";

const TABS = [
  { id: "decision", name: "Decision" },
  { id: "observation", name: "Saw" },
  { id: "reply", name: "Reply" },
  { id: "requests", name: "Requests" },
] as const;

export function AgentColumn({ match, line, open, toggle }: { match: Match; line: AgentLine; open: boolean; toggle: () => void }) {
  const tab = useSignal<string>("decision");
  const column = useRef<HTMLElement>(null);
  const key = keyOf(line);
  const decision = match.decisions.value.get(key);
  const tint = Math.min(Math.max(match.sides.value.indexOf(line.side), 0), 1);
  const panel = `panel-${match.id}-${key}`.replace(/[^\w-]/g, "-");
  useEffect(() => {
    if (agent.value === key) column.current?.scrollIntoView({ block: "nearest", inline: "nearest" });
  }, [agent.value === key, open]);
  if (!open)
    return (
      <section class={`agent closed tint-${tint}`}>
        <button class="agent-open" onClick={toggle} aria-expanded={false} title={`Open ${line.name}`}>
          <span class="dot" /> {line.name}
        </button>
      </section>
    );
  return (
    <section ref={column} class={`agent tint-${tint} ${agent.value === key ? "is-chosen" : ""}`} aria-label={`Agent ${line.name} of ${line.side}`}>
      <Header line={line} decision={decision} step={match.step.value} toggle={toggle} />
      <Tabs label={`Views of ${line.name}`} tabs={TABS} chosen={tab.value} choose={(id) => (tab.value = id)} panel={panel} />
      <div class="agent-body" role="tabpanel" id={panel} aria-labelledby={`${panel}-${tab.value}`} tabIndex={0}>
        {!decision && <p class="muted">{unasked(match, key)}</p>}
        {decision && tab.value === "decision" && <DecisionView decision={decision} />}
        {decision && tab.value !== "decision" && <Long match={match} decision={decision} tab={tab.value} />}
      </div>
    </section>
  );
}

function Header({ line, decision, step, toggle }: { line: AgentLine; decision: SeenDecision | undefined; step: number; toggle: () => void }) {
  const key = keyOf(line);
  const late = decision && decision.step < step ? ` · asked ${step - decision.step} steps ago` : "";
  return (
    <header class="agent-head">
      <button class="agent-name" aria-pressed={agent.value === key} onClick={() => (agent.value = agent.value === key ? "" : key)} title="Choose this agent: the map shows its screens and what it asks for">
        <span class="dot" /> {line.name}
      </button>
      <button class="plain" onClick={toggle} aria-expanded={true} aria-label={`Close ${line.name}`}>
        ✕
      </button>
      <p class="agent-about">
        {capital(line.side)} · {spaced(line.kind)} · {line.model || decision?.model || "model unknown"}
        {late}
      </p>
      {decision && (
        <p class="agent-figures">
          <Status decision={decision} />
          <span title="Time until the reply">{seconds(decision.latency_s)}</span>
          <span title={`Tokens read and written, in ${decision.usage.requests} requests`}>
            {short(decision.usage.prompt_tokens)}→{short(decision.usage.completion_tokens)} tok
          </span>
          {decision.usage.cost_usd !== null && <span title="Cost of this decision">{dollars(decision.usage.cost_usd)}</span>}
          {decision.attempts > 1 && <span>{decision.attempts} attempts</span>}
        </p>
      )}
    </header>
  );
}

function Status({ decision }: { decision: SeenDecision }) {
  const { status, fate, age_loops, detail } = decision;
  const bad = status !== null && status !== "ok";
  const words = status === null ? "thinking" : bad ? `${status}${detail ? `: ${detail}` : ""}` : (fate ?? "ok");
  const tone = bad || fate === "refused" || fate === "dropped" ? "bad" : fate === "stale" || fate === "adapted" ? "warn" : status === null ? "" : "good";
  return (
    <span class={`badge ${tone}`} title="What became of the decision">
      {words}
      {age_loops > 0 && ` +${age_loops} loops`}
    </span>
  );
}

function unasked(match: Match, key: string): string {
  const why = match.moment.value?.unasked[key];
  if (why === "no_units") return "It was not asked: it has no units to command.";
  return why ? "It was not asked yet: it is not due." : "It has not been asked yet.";
}

/** What is asked of the server only when somebody wants to read it. */
function Long({ match, decision, tab }: { match: Match; decision: SeenDecision; tab: string }) {
  const [asked, setAsked] = useState<DecisionTexts | null>(null);
  const [trouble, setTrouble] = useState("");
  useEffect(() => {
    let current = true;
    setTrouble("");
    match.asked(decision.side, decision.agent, decision.step).then(
      (answer) => current && setAsked(answer),
      (error: Error) => current && setTrouble(error.message),
    );
    return () => void (current = false);
  }, [match, decision.side, decision.agent, decision.step, decision.status]);
  if (trouble) return <p class="bad">{trouble}</p>;
  if (!asked) return <p class="muted">Loading…</p>;
  if (tab === "observation") return <Observation run={match.id} asked={asked} screens={decision.teams} />;
  if (tab === "requests") return <Requests run={match.id} calls={asked.calls} />;
  return (
    <pre class="long">
      <Words text={asked.reply || decision.reply} screens={decision.teams} />
    </pre>
  );
}
