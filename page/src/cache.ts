/** What was asked for lately, and who asks next. */

/** A map that forgets what was used longest ago. */
export class Recent<V> {
  private readonly held = new Map<string, V>();

  constructor(private readonly most: number) {}

  get(key: string): V | undefined {
    const value = this.held.get(key);
    if (value !== undefined) {
      this.held.delete(key);
      this.held.set(key, value);
    }
    return value;
  }

  set(key: string, value: V): void {
    this.held.delete(key);
    this.held.set(key, value);
    for (const oldest of this.held.keys()) {
      if (this.held.size <= this.most) break;
      this.held.delete(oldest);
    }
  }
}

/**
 * Return a function that loads one key at a time and then the newest that was asked for meanwhile, so that dragging
 * along the time line asks the server as often as it can answer, and never more.
 */
export function newest<T>(load: (key: string) => Promise<T>, done: (value: T, key: string) => void, failed: (error: Error) => void) {
  let busy = false;
  let next: string | null = null;
  async function run(key: string) {
    busy = true;
    try {
      done(await load(key), key);
    } catch (error) {
      failed(error as Error);
    }
    busy = false;
    if (next !== null) {
      const wanted = next;
      next = null;
      if (wanted !== key) void run(wanted);
    }
  }
  return (key: string) => {
    if (busy) next = key;
    else void run(key);
  };
}
