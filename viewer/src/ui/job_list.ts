// Progress of background jobs, such as recordings, which can be cancelled.

import type { Progress } from "../protocol/messages";
import { element, iconButton } from "./elements";

const DISPLAY_MS = 4000;

export class JobList {
  readonly box = element("div", { class: "job-list", attributes: { "aria-label": "Background jobs" } });
  private readonly jobs = new Map<string, { row: HTMLElement; bar: HTMLProgressElement; phase: HTMLElement; cancel: HTMLElement | null; timer: number }>();

  /** `cancel`: cancels a job by its name; null if jobs cannot be cancelled. */
  constructor(private readonly cancel: ((job: string) => void) | null) {}

  update(progress: Progress): void {
    let job = this.jobs.get(progress.job);
    if (job === undefined) {
      const bar = element("progress", { attributes: { max: "1", "aria-label": progress.job } });
      const phase = element("span", { class: "phase" });
      const { cancel: cancelJob } = this;
      const cancel = cancelJob === null ? null : iconButton("close", `Cancel: ${progress.job}`, () => cancelJob(progress.job));
      const row = element("div", { class: "job" }, element("span", { class: "name", text: progress.job }), phase, bar, cancel);
      job = { row, bar, phase, cancel, timer: 0 };
      this.jobs.set(progress.job, job);
      this.box.append(row);
    }
    window.clearTimeout(job.timer);
    job.phase.textContent = progress.done === true ? "done" : (progress.phase ?? "");
    if (job.cancel !== null) job.cancel.hidden = progress.done === true;
    if (progress.done === true) job.bar.value = 1;
    else if (typeof progress.fraction === "number") job.bar.value = Math.min(1, Math.max(0, progress.fraction));
    else job.bar.removeAttribute("value");
    if (progress.done === true) job.timer = window.setTimeout(() => this.remove(progress.job), DISPLAY_MS);
  }

  private remove(name: string): void {
    this.jobs.get(name)?.row.remove();
    this.jobs.delete(name);
  }

  clear(): void {
    for (const name of [...this.jobs.keys()]) this.remove(name);
  }
}
