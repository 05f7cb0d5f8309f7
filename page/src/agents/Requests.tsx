/** The requests to an agent's model as they were sent, and the answers as they came. */

import { dollars, seconds, whole } from "../words";
import type { ModelCall } from "../wire";
import { Picture } from "./Observation";

export function Requests({ run, calls }: { run: string; calls: readonly ModelCall[] }) {
  if (!calls.length) return <p class="muted">No request to a model is recorded: a scripted agent, or one that keeps its requests to itself.</p>;
  return (
    <>
      {calls.map((call, i) => (
        <Request key={i} run={run} call={call} open={i === calls.length - 1} />
      ))}
    </>
  );
}

function Request({ run, call, open }: { run: string; call: ModelCall; open: boolean }) {
  const { usage } = call;
  return (
    <details open={open}>
      <summary>
        <span class={`badge ${call.status === "ok" ? "good" : "bad"}`}>{call.status}</span> {call.purpose}, attempt {call.attempt}, {seconds(call.latency_s)}
      </summary>
      <dl class="facts">
        <dt>model</dt>
        <dd>
          {call.model}
          {call.answered_by && ` (answered by ${call.answered_by})`}
        </dd>
        <dt>endpoint</dt>
        <dd>{call.endpoint}</dd>
        <dt>began</dt>
        <dd>
          {seconds(call.started_s)} after the observation{call.waited_s > 0 && `, waited ${seconds(call.waited_s)} in the queue`}
        </dd>
        <dt>tokens</dt>
        <dd>
          {whole(usage.prompt_tokens)} read ({whole(usage.cached_tokens)} cached), {whole(usage.completion_tokens)} written ({whole(usage.reasoning_tokens)} reasoning), {dollars(usage.cost_usd)}
        </dd>
        {Object.entries(call.params).map(([name, value]) => (
          <>
            <dt>{name}</dt>
            <dd>{String(value)}</dd>
          </>
        ))}
      </dl>
      {call.prompt.map((message, i) => (
        <details key={i} open={i === call.prompt.length - 1}>
          <summary>
            {message.role}, {whole(message.content.length)} characters
          </summary>
          {message.images.map((image) => (
            <Picture key={image.sha256} run={run} image={image} />
          ))}
          <pre class="long">{message.content}</pre>
        </details>
      ))}
      <h4>Answer</h4>
      <pre class="long answer">{call.completion ?? "None came."}</pre>
    </details>
  );
}
