// Made by `python -m page.typescript` from khala_sc2/view/wire.py: change it there.

/** The cost of a valid action. */
export interface ActionCost {
  action: string;
  minerals: number;
  vespene: number;
  supply: number;
  /** How often it could be paid for now; at most 1 for research. */
  times: number;
  /** Seconds until its product is finished, without a boost. */
  time_s: number;
  /** Width and height of the ground that it takes, in world units; None for actions without a point. */
  footprint: [number, number] | null;
  /** Whether it makes the first structure of its type. */
  first: boolean;
}

/** One text action of the catalogue, as an agent sees it. */
export interface ActionSpec {
  name: string;
  args: ("tag" | "screen" | "minimap")[];
  description: string;
  /** How many of its first arguments name the units that carry it out. */
  actors: number;
  /** Whose unit its last tag names; None for anybody's. */
  target: "enemy" | "own" | null;
}

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

/** A place where units of the own side lost health or died since the last observation. */
export interface Alert {
  minimap: [number, number];
  /** How many, by type. */
  units: Record<string, number>;
  /** Health and shield that they lost, without the units that died. */
  lost: number;
  died: number;
}

/** The army of a side, and what it knows of the enemy's. */
export interface Army {
  parts: ArmyPart[];
  /** Workers and unarmed units that are on their way to a place far from home. */
  scouts: ArmyPart[];
  /** Armed enemy units, the nearest to home first. */
  enemies: ArmyPart[];
  /** Minerals and vespene of the whole army. */
  value: number;
}

/** Own units of the army that are together, or enemy units as they were last seen. */
export interface ArmyPart {
  /** The name of the place where they are; "" between places. */
  place: string;
  minimap: [number, number];
  units: Record<string, number>;
  /** What most of them do: `idle`, `attack at [40, 46]`; "" for enemies. */
  doing: string;
  /** Minerals and vespene that they cost. */
  value: number;
  /** How many of the enemies are; of the others it tells where they were seen. */
  in_sight: number;
  /** Seconds since any of these enemies was in sight. */
  unseen_s: number;
  /** Of enemies: world units to the nearest own town hall. */
  away: number | null;
}

/** One message of a prompt. */
export interface ChatMessage {
  role: "system" | "user" | "assistant";
  content: string;
  /** Pictures before the text, in their order. */
  images: ImageRef[];
}

/** Everything that a side has, makes and knows of. */
export interface Counts {
  units: TypeCount[];
  structures: TypeCount[];
  production: Production[];
  /** Structures that workers are on their way to build, by type. */
  planned: Record<string, number>;
  enemies: EnemyCount[];
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
  reason: "malformed" | "unknown_action" | "wrong_arguments" | "unknown_team" | "unknown_target" | "dead_target" | "not_yours" | "invalid_target" | "friendly_target" | "wrong_frame" | "out_of_bounds" | "not_available" | "too_many_actions" | "unknown_recipient" | "unread" | "too_late" | "too_many_messages" | "refused_by_game" | null;
  /** Why it was refused, as the agent reads it. */
  message: string;
  /** Units that it names. */
  tags: number[];
  /** The place that it names, in the minimap frame. */
  at: [number, number] | null;
}

/** What comes in and what it is spent on. */
export interface Economy {
  /** Minerals and vespene per minute at present. */
  income: [number, number];
  /** Minerals and vespene spent in the last minute. */
  spending: [number, number];
  /** Workers on minerals, on vespene, and without an order. */
  gatherers: [number, number, number];
  /** How many workers the finished bases and gas structures have work for, at minerals and at vespene. */
  room: [number, number];
  /** Supply that is under construction. */
  supply_coming: number;
  /**
   * Seconds until no supply is left, at the pace of the last minute and with what is under construction; None if
   * none was used.
   */
  full_in_s: number | null;
  /** Energy of each own unit or structure that has any, by type. */
  casters: Record<string, number[]>;
}

export type EffectMark = [name: string, player: number, x: number, y: number, radius: number];

/** An effect on the ground that a team's screen shows: a storm, a bile on its way, a force field. */
export interface EffectView {
  /** As in PySC2's `features.Effects`; `ForceField`. */
  name: string;
  alliance: "own" | "ally" | "enemy" | "neutral";
  /** In world units; 0 if the game gives none. */
  radius: number;
  screen: [number, number][];
  /** Seconds until it ends, at most; None if that is not known. */
  left_s: number | null;
}

/** How many of an enemy's type were seen in this episode. */
export interface EnemyCount {
  type: string;
  /** Different units, alive or dead. */
  seen: number;
  in_sight: number;
  dead: number;
  /** Place where one of them was last seen. */
  minimap: [number, number] | null;
  /** Seconds since one of them was last seen. */
  unseen_s: number;
}

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

/** A change of a unit between the last observation and this one. */
export interface Event {
  what: "hurt" | "healed" | "died" | "joined" | "appeared" | "disappeared" | "finished" | "researched";
  /** Empty for `researched`, which concerns no unit. */
  tag: string;
  /** Type of the unit; the upgrade's name for `researched`. */
  type: string;
  alliance: "own" | "ally" | "enemy" | "neutral";
  /** Health and shield lost (`hurt`) or regained (`healed`). */
  amount: number | null;
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

/** A thing on the map whose tag an action takes. */
export interface Landmark {
  what: "base place" | "geyser" | "power field" | "structure";
  tag: string;
  type: string;
  minimap: [number, number];
  /** Its place, if it is on the screen of the agent's first team. */
  screen: [number, number] | null;
  /** Further information. */
  about: string;
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
  /** Absent if the endpoint told none of them; it tells them if `extra` of the model file asks for them. */
  tokens: TokenTrace | null;
}

/** A note that an agent has written to itself. */
export interface NoteView {
  /** From 1, in the order in which the agent wrote them; no other note of the episode has it. */
  number: number;
  /** Seconds on the game's clock when it was written. */
  time_s: number;
  text: string;
}

/** One order of a unit of the own side. */
export interface OrderView {
  /** General name of what it does, `Attack`. */
  name: string;
  /** Tag of the unit that it targets. */
  target: string | null;
  /** The point that it targets. */
  minimap: [number, number] | null;
  /** Progress, 0 to 1, of training, research or morphing; None for orders without progress. */
  progress: number | null;
}

/** Server → page: what became of an advice, or why something cannot be had. */
export interface PageNote {
  kind: "note";
  ok: boolean;
  text: string;
}

/** A place of the map with a name, the same for all agents of a side and all of an episode. */
export interface Place {
  /** `Base 2`, counted by the way from where the side began. */
  name: string;
  what: "base" | "ramp" | "passage";
  minimap: [number, number];
  /** Whether a player may begin there. */
  start: boolean;
  /** Whose town hall stands there, as far as the side knows. */
  holder: "" | "own" | "enemy";
  /** Seconds since the place was last in sight; None if it never was. */
  unseen_s: number | null;
  about: string;
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

/** Units and upgrades in training, research or morphing, by the name of the order. */
export interface Production {
  order: string;
  /** Progress of each one that has begun, 0 to 1, the farthest first. */
  progress: number[];
  /** How many more are queued. */
  queued: number;
}

/** A message as its recipient gets it. */
export interface Received {
  sender: string;
  /** The agent's own name, or the channel it listens to. */
  recipient: string;
  text: string;
  /**
   * Seconds of the game since it was written; None if messages are shown once (`MemoryRule.messages_s`).
   */
  age_s: number | null;
  /** Whether an earlier observation had it, too. */
  again: boolean;
}

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

/**
 * A call, or text that looked like one, that was not executed. The agent gets it with the next observation.
 */
export interface Rejection {
  reason: "malformed" | "unknown_action" | "wrong_arguments" | "unknown_team" | "unknown_target" | "dead_target" | "not_yours" | "invalid_target" | "friendly_target" | "wrong_frame" | "out_of_bounds" | "not_available" | "too_many_actions" | "unknown_recipient" | "unread" | "too_late" | "too_many_messages" | "refused_by_game";
  /** One sentence for the model: what was wrong, and what would be right. */
  message: string;
  /** The rejected words, as much of them as fits; empty if it stands for several. */
  text: string;
  /** Offset of `text` in the reply. */
  start: number;
  team: string | null;
  /**
   * How many it stands for, by reason, if an observation has no room for them; else it stands for itself.
   */
  others: Record<string, number>;
}

export type ResourceMark = [tag: number, type: string, x: number, y: number, radius: number];

/** The numbers at the top of a player's screen. */
export interface Resources {
  minerals: number;
  vespene: number;
  supply_used: number;
  supply_cap: number;
  /** Resources reserved for structures that workers are on their way to build, as minerals and vespene. */
  promised: [number, number];
}

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

/** Server → page: who the person is, and what it may do. */
export interface SeatBriefing {
  kind: "briefing";
  agent: string;
  side: string;
  episode: number;
  episodes: number;
  /** What a model reads before its observations, word for word. */
  text: string;
  /** Names of all that its teams may ever do; the page gives each a key that stays. */
  actions: string[];
  correspondents: string[];
  channels: string[];
}

/** Server → page: an observation to answer. */
export interface SeatQuestion {
  kind: "question";
  episode: number;
  step: number;
  /** Seconds to answer in all; None for no limit. */
  time_s: number | null;
  text: string;
  view: View;
  images: ImageRef[];
  /** Calls of the answer before that were carried out, as written. */
  accepted: string[];
  rejections: Rejection[];
  messages: Received[];
}

/** Page → server: the answer to a question. */
export interface SeatReply {
  kind: "reply";
  episode: number;
  step: number;
  text: string;
}

/** How an episode ended for the person's side. */
export interface SeatResult {
  episode: number;
  /** In words: `win, enemy defeated`. */
  ending: string;
  valid: boolean;
  invalid_because: string;
  /** Minerals and vespene. */
  killed: number;
  lost: number;
}

/** Server → page: how the seat is, whenever that changes. */
export interface SeatState {
  kind: "state";
  /** Whether this window plays the seat. */
  mine: boolean;
  /** Whether the newest question waits for an answer. */
  waits: boolean;
  /** Seconds until its time is over; None for no limit, or if it does not wait. */
  left_s: number | null;
  /** The answer to the newest question; None without one. */
  sent: string | null;
  results: SeatResult[];
  /** Whether the match is over. */
  over: boolean;
}

/** Page → server: this window plays the seat from now on. */
export interface SeatTake {
  kind: "take";
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

/** An order that the host gives again and again until it is revoked or its end is reached. */
export interface StandingView {
  /** From 1, in the order in which the agent gave them; no other one of the episode has it. */
  number: number;
  /** The order and its end, `Developer <Train_Probe()> until 22 Probe`. */
  order: string;
  /** How often it was carried out. */
  times: number;
  /** Why it cannot be carried out at this moment; "" if it can. */
  waits_for: string;
  /** Why it is no longer in force; "" if it is. The next observation no longer has it. */
  ended: string;
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

/** A team of another agent, as a commander sees it. */
export interface TeamReport {
  agent: string;
  name: string;
  minimap: [number, number];
  /** How many, by type. */
  units: Record<string, number>;
  /** Health and shield of all of them, 0 to 1 of their maximum. */
  health: number;
}

/** One team of an agent: its units, and what they see on their screen. */
export interface TeamView {
  name: string;
  /** Centre of the team's camera; None for a team without units, which gives orders to the whole side. */
  minimap: [number, number] | null;
  /** Its current task. */
  task: string;
  units: UnitView[];
  allies: UnitView[];
  enemies: UnitView[];
  effects: EffectView[];
  events: Event[];
  /** Actions that are valid for this team now. */
  actions: ActionSpec[];
  /** Valid actions that have a cost. */
  offers: ActionCost[];
  /** Valid actions for which only some arguments will do. */
  arguments: ValidArguments[];
  /** Actions of this team that are not valid now. */
  barred: UnavailableAction[];
  /** Minerals and geysers on its screen; for builders only. */
  resources: UnitView[];
  /** The part of the screen frame that lies on the playable map: x0, y0, x1, y1. */
  bounds: [number, number, number, number];
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

/**
 * The tokens of a request and its answer, as far as the endpoint told them; what it did not tell is empty.
 */
export interface TokenTrace {
  /** Of the whole prompt, with what the chat template adds. */
  prompt_ids: number[];
  /** Of all that the model generated, its reasoning as well. */
  reply_ids: number[];
  /** Natural logarithm of the probability of each generated token; -9999 for 0, as vLLM has it. */
  logprobs: number[];
}

/** The losses of both sides since an agent's last order. */
export interface Toll {
  since_s: number;
  lost: Record<string, number>;
  killed: Record<string, number>;
}

/** How many units of a type the own side has. */
export interface TypeCount {
  type: string;
  /** Number of finished ones. */
  ready: number;
  /** Number of finished ones without an order; None for types that neither produce nor gather. */
  idle: number | null;
  /** Progress of each one that is being built or warped in, 0 to 1, the farthest first. */
  under_way: number[];
}

/** An action that is not valid now. */
export interface UnavailableAction {
  action: string;
  /** As the end of a sentence: `no Stargate`. */
  reason: string;
}

/** Details that only some units have. */
export interface UnitDetails {
  /** Types of the units inside; own units only. */
  passengers: string[];
  /** Room for passengers; 0 for units without room, and for others' units. */
  cargo_max: number;
  burrowed: boolean;
  /** Whether an own structure is idle because it lacks a power field. */
  unpowered: boolean;
  /** Minerals or vespene left in a resource. */
  contents: number | null;
  /** Workers of an own base or gas structure, and how many it has work for. */
  harvesters: [number, number] | null;
  /** Of the skills that the agent may use, those that a unit of its team could use now. */
  ready: string[];
  /**
   * Of these, the ones that only other units of its team could use now, or that will be ready again: the
   * seconds until then at most, None if they are not known.
   */
  unready: Record<string, number | null>;
  /** Seconds until its buff ends, or a unit that lives for a time only; own units only. */
  left_s: number | null;
}

export type UnitMark = [tag: number, type: string, player: number, x: number, y: number, radius: number, facing: number, health: number, health_max: number, shield: number, shield_max: number, energy: number, progress: number, flags: number, seen_by: number, order: string, target: number, to_x: number, to_y: number];

/** One unit in sight of a team, in the team's screen frame. */
export interface UnitView {
  /** Hexadecimal, `0x1002c0001`; the name under which actions speak of the unit. */
  tag: string;
  /** Name as in `pysc2.lib.units`, without the race. */
  type: string;
  alliance: "own" | "ally" | "enemy" | "neutral";
  screen: [number, number];
  minimap: [number, number];
  /** From the mean position of the team's units, in world units; enemies only. */
  distance: number | null;
  health: number;
  health_max: number;
  shield: number;
  shield_max: number;
  energy: number;
  energy_max: number;
  /** Seconds until the weapon is ready; None for units without one, or of others. */
  weapon_cooldown_s: number | null;
  /** 0 to 1; 1 is finished. */
  build_progress: number;
  flying: boolean;
  cloaked: boolean;
  hallucination: boolean;
  buffs: string[];
  /** Name of its current order; own units only. */
  order: string | null;
  /** Its current order, and the orders queued after it. */
  orders: OrderView[];
  /** Details that only some units have; None for all others. */
  details: UnitDetails | null;
}

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

/** Arguments with which a valid action is accepted, if not all do that its kind suggests. */
export interface ValidArguments {
  action: string;
  /** Tags of the units that can carry it out; () for every unit of the team. */
  units: string[];
  /** Tags of targets that will do; () for every enemy, or every other unit, on the screen. */
  tags: string[];
  /** Some points of the screen that will do; () if every place on the map does. */
  points: [number, number][];
}

/** The structured form of an observation's text. */
export interface View {
  /** Seconds on the game's clock: game loop / 22.4. */
  time_s: number;
  resources: Resources;
  upgrades: string[];
  /** World units that a cell of the minimap is wide. */
  cell: number;
  /** The part of the minimap frame that is the playable map: x0, y0, x1, y1. */
  bounds: [number, number, number, number];
  teams: TeamView[];
  /** For commanders, developers and builders, like all that follows. */
  counts: Counts | null;
  /** Events of the whole side. */
  events: Event[];
  /** Warnings of the game itself, `NuclearLaunchDetected`. */
  warnings: string[];
  alerts: Alert[];
  others: TeamReport[];
  landmarks: Landmark[];
  places: Place[];
  /** What the opponent chose, `random` too. */
  enemy_race: string;
  army: Army | null;
  toll: Toll | null;
  economy: Economy | null;
  warp_gates: WarpGates | null;
  notes: NoteView[];
  standing: StandingView[];
}

/** How many units can be warped in. */
export interface WarpGates {
  count: number;
  /** None if the game was not asked. */
  ready: number | null;
}

/** Properties of a unit of a scene: bits of `flags`. */
export const Flag = { STRUCTURE: 1, WORKER: 2, ARMY: 4, FLYING: 8, BURROWED: 16, CLOAKED: 32, HALLUCINATION: 64, UNPOWERED: 128, REMEMBERED: 256, FIRES: 512 } as const;

export const SCENES_AT_ONCE = 16;
