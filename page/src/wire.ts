// Made by `python -m page.typescript` from khala_sc2/view/wire.py: change it there.

/** Page → server: what a person writes to agents. */
export interface AdviceNote {
  kind: "advice";
  side: string;
  /** An agent, a channel, or `everyone`. */
  recipient: string;
  text: string;
}

/** One agent of a match. */
export interface AgentLine {
  side: string;
  name: string;
  kind: "combat_group" | "commander" | "developer" | "builder";
  /** Of a scripted agent the name of its policy; "" if it is unknown. */
  model: string;
  teams: string[];
  role: string;
}

/** One message of a prompt. */
export interface ChatMessage {
  role: "system" | "user" | "assistant";
  content: string;
  /** Pictures before the text, in their order. */
  images: ImageRef[];
}

/** A number over the steps of an episode. */
export interface Curve {
  name: "army_value" | "workers" | "supply_used" | "supply_cap" | "minerals" | "vespene" | "income_minerals" | "income_vespene" | "killed_value" | "lost_value" | "latency_s" | "tokens" | "cost_usd" | "refused" | "score";
  /** An opponent that Khala does not play is `opponent`; "" for what belongs to neither side. */
  side: string;
  /**
   * One for each step of the time line; sums (killed, lost, tokens, money, refused) are since the beginning.
   */
  values: (number | null)[];
}

/** The long texts of a decision. */
export interface DecisionTexts {
  side: string;
  agent: string;
  /** Of the observation: at the asked step, or the last one before it. */
  step: number;
  /** The observation in words. */
  text: string;
  /** The agent's observation before; None for its first one. */
  before: string | null;
  reply: string;
  images: ImageRef[];
  /** Requests to its model, in their order. */
  calls: ModelCall[];
}

/** One call of a reply, and what became of it. */
export interface Deed {
  text: string;
  /** Offset in the reply, in characters. */
  start: number;
  team: string;
  /** None while its step is not over, or if the host did not say. */
  accepted: boolean | null;
  reason: "malformed" | "unknown_action" | "wrong_arguments" | "unknown_team" | "unknown_target" | "dead_target" | "not_yours" | "invalid_target" | "wrong_frame" | "out_of_bounds" | "not_available" | "too_many_actions" | "unknown_recipient" | "unread" | "too_late" | "too_many_messages" | "refused_by_game" | null;
  /** Why it was refused, as the agent reads it. */
  message: string;
  /** Units that it names. */
  tags: number[];
  /** The place that it names, in the minimap frame. */
  at: [number, number] | null;
}

export type EffectMark = [name: string, player: number, x: number, y: number, radius: number];

/** One episode of a match. */
export interface EpisodeLine {
  episode: number;
  /** So far. */
  steps: number;
  game_s: number;
  wall_s: number | null;
  /** By side; empty while it is played. */
  outcomes: Record<string, "win" | "draw" | "loss" | "cut" | "aborted">;
  causes: Record<string, string>;
  kd: Record<string, number | null>;
  invalid_because: string;
}

/** One experiment, as a list shows it. */
export interface ExperimentLine {
  id: string;
  name: string;
  description: string;
  played: number;
  matches: number;
}

/** An experiment's table. */
export interface ExperimentView {
  line: ExperimentLine;
  factors: string[];
  columns: string[];
  rows: TableRow[];
  /** What the reader of the table must know. */
  notes: string[];
  runs: RunLine[];
}

/** A grid of cells over the whole map, seen from above. */
export interface GridView {
  /** Cells from west to east. */
  width: number;
  /** Cells from north to south. */
  height: number;
  /** A byte for each cell, row after row from the north-west, deflated (zlib), in base64. */
  data: string;
}

/** A picture that belongs to an observation; its bytes travel on their own topic. */
export interface ImageRef {
  name: string;
  media_type: "image/jpeg" | "image/png" | "image/webp";
  /** Hash of the bytes, by which a receiver finds them among the pictures that arrived. */
  sha256: string;
  /** One line that explains the picture to a model. */
  title: string;
  /** In pixels. */
  width: number;
  height: number;
  /** Number of bytes. */
  bytes: number;
}

/** A message as it was sent or read. */
export interface Letter {
  sender: string;
  recipient: string;
  text: string;
  /** In which it was sent, or shown. */
  step: number;
  human: boolean;
  again: boolean;
}

/** What can be opened. */
export interface Library {
  /** What `khala view` was asked for: a directory, a file, a run. */
  title: string;
  runs: RunLine[];
  experiments: ExperimentLine[];
  /** Ids of the one or two runs that were asked for; the page begins with them. */
  opened: string[];
}

/** Something that happened at a step. */
export interface Mark {
  step: number;
  kind: "fight" | "death" | "building" | "upgrade" | "message" | "advice" | "late" | "fallback" | "refused" | "incident" | "end";
  side: string;
  agent: string;
  /** In a few words: `2 Stalkers died`. */
  text: string;
  /** How much: of a fight the value that was lost, of others their number. */
  weight: number;
  at: [number, number] | null;
}

/** Agent → recorder: one request to a model and its answer. Never a key. */
export interface ModelCall {
  /** Major version of the schema. */
  v: 1;
  /** Name of the run; the same as in the key. */
  run: string;
  kind: "exchange";
  agent: string;
  side: string;
  episode: number;
  step: number;
  purpose: "decision" | "summary";
  /** Number of the try, from 1, of this step and purpose. */
  attempt: number;
  /** As it was asked for. */
  model: string;
  /** As the endpoint called it in its answer, with its version; "" if it did not say. */
  answered_by: string;
  /** Base URL without credentials or query. */
  endpoint: string;
  prompt: ChatMessage[];
  params: Record<string, string | number | number | boolean | null>;
  /** None if no answer came. */
  completion: string | null;
  /** Why it ended, in the words of the endpoint: `stop`, `length`, … */
  finish: string;
  /**
   * `ok`, `empty`, `cut`, `refused` or `filtered` of an answer; else `timeout`, `cancelled`, `http 429`,
   * `connection`, `malformed`.
   */
  status: string;
  /** Why there is nothing to play, in the words of the endpoint; "" if there is. */
  reason: string;
  /** Since the observation's arrival. */
  started_s: number;
  latency_s: number;
  /** Time spent before the request in the queue of the shared limits. */
  waited_s: number;
  /** Parts of the prompt that were left out so that it fits the model's context. */
  left_out: string[];
  /** Estimated tokens to which the prompt was fitted; None if it is whole. */
  room_tokens: number | null;
  usage: Usage;
}

/** Server → page: what became of an advice, or why something cannot be had. */
export interface PageNote {
  kind: "note";
  ok: boolean;
  text: string;
}

/** One player of a scene. */
export interface PlayerMark {
  /** Its number, from 1. */
  player: number;
  /** The side that Khala plays; "" for an opponent. */
  side: string;
  race: string;
  /** Units and structures that this scene has of it. */
  units: number;
  workers: number;
  /** Minerals and vespene of its army. */
  army_value: number;
  /** None for a player whose resources Khala does not see. */
  minerals: number | null;
  vespene: number | null;
  supply_used: number | null;
  supply_cap: number | null;
  /** Minerals and vespene per minute. */
  income: [number, number] | null;
  upgrades: string[];
}

export type PowerMark = [player: number, x: number, y: number, radius: number];

/** Server → page: there is more to see. */
export interface RecordingProgress {
  kind: "progress";
  episode: number;
  /** Of this episode, so far. */
  steps: number;
  indexed: number;
  live: boolean;
  /**
   * Seconds from the host's report of the newest step until it could be asked for; None if nothing is live.
   */
  lag_s: number | null;
}

export type ResourceMark = [tag: number, type: string, x: number, y: number, radius: number];

/** One recording, as a list shows it. */
export interface RunLine {
  /** Its name in paths. */
  id: string;
  /** Of the recording, below the directory that was opened. */
  path: string;
  run: string;
  task: string;
  map: string;
  seed: number;
  /** Who played against the agents; "" with two sides. */
  opponent: string;
  clock: string;
  /** Different models, by name, as far as they are known. */
  models: string[];
  /** Seconds since 1970. */
  recorded_at_s: number;
  /** By side, of each episode that ended. */
  outcomes: Record<string, ("win" | "draw" | "loss" | "cut" | "aborted")[]>;
  valid: boolean;
  /** False for a recording that is torn, or still grows. */
  complete: boolean;
  live: boolean;
  episodes: number;
  steps: number;
  game_s: number;
  cost_usd: number | null;
  size_bytes: number;
  /** Its place in an experiment's grid. */
  labels: Record<string, string>;
}

/** A run, as its page begins. */
export interface RunView {
  line: RunLine;
  sides: string[];
  agents: AgentLine[];
  episodes: EpisodeLine[];
  /** The part of the recording that is indexed, 0 to 1; more follows on the websocket. */
  indexed: number;
  /**
   * What the map is drawn from: scenes without fog, scenes of what the sides saw, or the agents' observations of a
   * recording that has no scenes.
   */
  scenes: "whole" | "seen" | "views";
  /** Whether advice can be sent to its agents. */
  can_advise: boolean;
  /** The run card as recorded. */
  card: Record<string, unknown>;
}

/**
 * Host → all but agents: the whole map at one step, before its decisions take effect. Never for agents.
 */
export interface Scene {
  /** Major version of the schema. */
  v: 1;
  /** Name of the run; the same as in the key. */
  run: string;
  kind: "scene";
  episode: number;
  step: number;
  game_loop: number;
  /** The sides that Khala plays, in the order of the bits of `UnitMark.seen_by`. */
  sides: string[];
  /**
   * Whether it has all units: the game showed the map without fog, or all players are Khala's. Otherwise it is what
   * the sides know together.
   */
  whole: boolean;
  players: PlayerMark[];
  /** Units and structures, without the resources of the map. */
  units: UnitMark[];
  effects: EffectMark[];
  /** Power fields of the sides. */
  power: PowerMark[];
  /** Tags of the terrain's resources that are no longer there, as far as anybody knows. */
  gone: number[];
  /** 1 where creep is; None if there is none. */
  creep: GridView | null;
  /** By side: 2 where it sees now, 1 where it once saw, 0 elsewhere. */
  fog: Record<string, GridView>;
}

/** Scenes in the order of their steps. */
export interface Scenes {
  scenes: Scene[];
}

/** What an agent last was asked, and what it answered. */
export interface SeenDecision {
  side: string;
  agent: string;
  /** Of the observation. */
  step: number;
  game_loop: number;
  /** In which its answer took effect; None if that has not happened. */
  effect_step: number | null;
  status: "ok" | "empty" | "cut" | "refused" | "filtered" | "malformed" | "failed" | "late" | "fallback" | "gone" | null;
  detail: string;
  fate: "fresh" | "stale" | "adapted" | "refused" | "dropped" | null;
  age_loops: number;
  latency_s: number | null;
  attempts: number;
  usage: Usage;
  model: string;
  teams: SeenTeam[];
  /** The reply before its first heading: what the agent makes of its position. */
  thought: string;
  /** Word for word. */
  reply: string;
  deeds: Deed[];
  sent: Letter[];
  read: Letter[];
  images: ImageRef[];
}

/** A team as its agent saw it. */
export interface SeenTeam {
  name: string;
  tags: number[];
  /** Centre of its screen. */
  minimap: [number, number] | null;
  /** Size of its screen, in the minimap frame. */
  screen: number;
}

/** The state of one side at a step. */
export interface SideMoment {
  side: string;
  score: number;
  killed_value: number;
  lost_value: number;
  tokens: number;
  cost_usd: number | null;
}

/** Everything about one step but the map. */
export interface StepView {
  episode: number;
  step: number;
  game_loop: number;
  time_s: number;
  sides: SideMoment[];
  /** The last one of each agent up to this step, in the order of the agents. */
  decisions: SeenDecision[];
  /** By `side/agent`. */
  unasked: Record<string, "no_units" | "not_due">;
  incidents: string[];
  /** What the game executed, by side `blue: Attack_screen …`. */
  functions: string[];
  timings: Timings;
}

/** A cell of a table: a number with its interval. */
export interface TableCell {
  /** As the report prints it: `45 % (25 to 66)`. */
  text: string;
  value: number | null;
  low: number | null;
  high: number | null;
}

/** One place of the grid. */
export interface TableRow {
  /** The values of the factors. */
  names: string[];
  games: number;
  cells: TableCell[];
  /** Ids of its recordings. */
  runs: string[];
}

/** Host → all but agents: the ground of an episode, once at its beginning. */
export interface Terrain {
  /** Major version of the schema. */
  v: 1;
  /** Name of the run; the same as in the key. */
  run: string;
  kind: "terrain";
  episode: number;
  /** Width and height of the map, in world units. */
  size: [number, number];
  /** The playable part of the minimap frame: x0, y0, x1, y1. */
  bounds: [number, number, number, number];
  /** Size of the minimap frame, which holds the longer side of the map. */
  minimap: number;
  /** Height of the ground, 0 to 255 for -16 to 16 world units. */
  height: GridView;
  /** 1 where ground units can walk. */
  walkable: GridView;
  resources: ResourceMark[];
  /** Places where a player may begin, as far as the game says. */
  starts: [number, number][];
}

/** Every step of an episode, in columns of one length. */
export interface Timeline {
  episode: number;
  steps: number[];
  time_s: number[];
  loops: number[];
  /** By `side/agent`, the steps in which it was asked. */
  asked: Record<string, number[]>;
  curves: Curve[];
  marks: Mark[];
}

/** Where the wall time of a step went, in seconds. */
export interface Timings {
  observe_s: number;
  publish_s: number;
  wait_s: number;
  /**
   * Of `wait_s`: until the last required agent that was away was back, and had its whole time again; the rest is
   * within the deadline.
   */
  held_s: number;
  act_s: number;
  game_s: number;
  /** With the clock `realtime`: how much the game is behind the wall clock since the episode began. */
  lag_s: number;
}

export type UnitMark = [tag: number, type: string, player: number, x: number, y: number, radius: number, facing: number, health: number, health_max: number, shield: number, shield_max: number, energy: number, progress: number, flags: number, seen_by: number, order: string, target: number, to_x: number, to_y: number];

/** The usage of requests to a model. Sums with `+`, and no sum is more than `MOST`. */
export interface Usage {
  requests: number;
  prompt_tokens: number;
  completion_tokens: number;
  /** The part of `prompt_tokens` that the provider had in its cache. */
  cached_tokens: number;
  /** The part of `prompt_tokens` that the provider put into its cache. */
  cache_write_tokens: number;
  /** The part of `completion_tokens` that was reasoning. */
  reasoning_tokens: number;
  /** None if no price is known for the model. */
  cost_usd: number | null;
  /** Requests that were cancelled or failed, whose tokens are unknown. */
  unknown_requests: number;
  /** The most that these may have cost; None if no price is known for the model. */
  unknown_usd: number | null;
  /** Requests whose prompt was shortened to fit the model's context. */
  shortened_requests: number;
  /** By part of a prompt: from how many of these requests it was left out. */
  left_out: Record<string, number>;
  /** Number of pictures that were sent along. */
  images: number;
  /** The part of `prompt_tokens` for pictures, as the model file's rule estimates it. */
  image_tokens: number;
}

/** Properties of a unit of a scene: bits of `flags`. */
export const Flag = { STRUCTURE: 1, WORKER: 2, ARMY: 4, FLYING: 8, BURROWED: 16, CLOAKED: 32, HALLUCINATION: 64, UNPOWERED: 128, REMEMBERED: 256, FIRES: 512 } as const;

export const SCENES_AT_ONCE = 16;
