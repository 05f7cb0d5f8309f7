/** A recorded match that is open: what the server told of it, and the moment of it that the clock shows. */

import { batch, computed, effect, signal, type ReadonlySignal } from "@preact/signals";
import { get } from "./api";
import { Recent, newest } from "./cache";
import * as clock from "./clock";
import { SceneStore } from "./scenes";
import { locate, type Place } from "./time";
import type { AgentLine, DecisionTexts, Curve, SeenDecision, EpisodeLine, StepView, RecordingProgress, RunView, Terrain, Timeline } from "./wire";

/** The side of an opponent that Khala does not play. */
export const OPPONENT = "opponent";

/** Return the key of an agent in the answers that go by agent. */
export const keyOf = (agent: { side: string } & ({ name: string } | { agent: string })) =>
  `${agent.side}/${"name" in agent ? agent.name : agent.agent}`;

export class Match {
  readonly run = signal<RunView | null>(null);
  readonly timeline = signal<Timeline | null>(null);
  readonly terrain = signal<Terrain | null>(null);
  readonly moment = signal<StepView | null>(null);
  /** Why something could not be had; "" if all is well. */
  readonly trouble = signal("");
  /** Seconds that the page is behind a live match; null if it is not live. */
  readonly lag = signal<number | null>(null);
  readonly place: ReadonlySignal<Place>;
  readonly index: ReadonlySignal<number>;
  readonly step: ReadonlySignal<number>;
  readonly scenes: SceneStore;
  private readonly path: string;
  private readonly moments = new Recent<StepView>(256);
  private readonly askedOf = new Recent<DecisionTexts>(64);
  private readonly endings: (() => void)[] = [];

  constructor(readonly id: string, readonly episode: number) {
    this.path = `runs/${id}/episodes/${episode}`;
    this.scenes = new SceneStore(this.path, () => this.grows());
    this.place = computed(() => (this.timeline.value ? locate(this.timeline.value, clock.axis.value, clock.at.value) : { index: 0, fraction: 0 }));
    this.index = computed(() => this.place.value.index);
    this.step = computed(() => this.timeline.value?.steps[this.index.value] ?? 0);
    this.watch();
  }

  /** Ask for what the page begins with. */
  async open(): Promise<void> {
    try {
      await this.take(this.run, `runs/${this.id}`);
      if (!this.line.value && this.grows()) return; // `grow` asks when the episode has begun
      await Promise.all([this.take(this.timeline, `${this.path}/timeline`), this.takeTerrain()]);
    } catch (error) {
      if (!this.grows()) this.trouble.value = (error as Error).message;
    }
  }

  /** Take what is new in a recording that grows. */
  async grow(progress: RecordingProgress): Promise<void> {
    this.lag.value = progress.live ? progress.lag_s : null;
    const known = this.timeline.value;
    const ended = !progress.live && progress.indexed >= 1; // the last line that comes
    const old = this.run.value;
    const run = ended || !this.line.value || old?.indexed !== progress.indexed ? await get<RunView>(`runs/${this.id}`) : old;
    const enough = known && !ended && progress.episode === this.episode && known.steps.length >= progress.steps;
    const timeline = enough || !this.lineIn(run) ? null : await this.newTimeline();
    batch(() => {
      this.run.value = run; // not before its last steps: a link to one of them waits while there are more to come
      if (timeline) this.timeline.value = timeline;
    });
    if (timeline && !this.terrain.value) await this.takeTerrain();
  }

  /** Return the long texts of what an agent was asked last up to a step. */
  async asked(side: string, agent: string, step: number): Promise<DecisionTexts> {
    const path = `${this.path}/steps/${step}/agents/${side}/${agent}`;
    const held = this.grows() ? undefined : this.askedOf.get(path);
    const answer = held ?? (await get<DecisionTexts>(path));
    this.askedOf.set(path, answer);
    return answer;
  }

  close(): void {
    for (const end of this.endings) end();
  }

  /** Whether more of it is to come: it is played, or not yet read to its end. */
  grows = () => this.isLive() || (this.run.value?.indexed ?? 1) < 1;

  isLive = () => this.run.value?.line.live ?? false;

  /** The sides as a reader counts them: those that Khala plays, and an opponent that it does not. */
  readonly sides = computed(() => {
    const played = this.run.value?.sides ?? [];
    return played.length === 1 ? [...played, OPPONENT] : [...played];
  });

  readonly agents = computed<AgentLine[]>(() => this.run.value?.agents ?? []);

  readonly line = computed<EpisodeLine | undefined>(() => this.lineIn(this.run.value));

  readonly decisions = computed(() => new Map<string, SeenDecision>((this.moment.value?.decisions ?? []).map((d) => [keyOf(d), d])));

  private readonly curves = computed(() => new Map((this.timeline.value?.curves ?? []).map((c) => [`${c.name}/${c.side}`, c.values])));

  /** Return a curve of a side, if there is one. */
  curve(name: Curve["name"], side: string): readonly (number | null)[] | undefined {
    return this.curves.value.get(`${name}/${side}`);
  }

  /** Return the value of a curve at the moment, if it is known. */
  now(name: Curve["name"], side: string): number | null {
    const curve = this.curve(name, side);
    return curve?.[this.index.value] ?? curve?.[this.index.value - 1] ?? null; // the newest step of a live match has none yet
  }

  private watch(): void {
    const loadMoment = newest<StepView>(
      async (path) => (this.grows() ? undefined : this.moments.get(path)) ?? (await get<StepView>(path)),
      (moment, path) => {
        this.moments.set(path, moment);
        this.moment.value = moment;
        this.trouble.value = "";
      },
      (error) => (this.trouble.value = error.message),
    );
    let before = 0;
    this.endings.push(
      effect(() => {
        const timeline = this.timeline.value;
        if (!timeline?.steps.length) return;
        const step = this.step.value;
        loadMoment(`${this.path}/steps/${step}`);
        this.scenes.want(step, timeline.steps[timeline.steps.length - 1], step >= before);
        before = step;
      }),
    );
  }

  private lineIn = (run: RunView | null) => run?.episodes.find((e) => e.episode === this.episode);

  /** Return the time line as it is now; null if its first step is not read yet. */
  private newTimeline = () => get<Timeline>(`${this.path}/timeline`).catch(() => null);

  private async takeTerrain(): Promise<void> {
    await this.take(this.terrain, `${this.path}/terrain`).catch(() => undefined); // recordings of early versions have none
  }

  private async take<T>(place: { value: T | null }, path: string): Promise<void> {
    place.value = await get<T>(path);
  }
}
