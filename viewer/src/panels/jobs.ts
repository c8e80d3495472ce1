// Recordings and other long work that goes on beside: how far it is.

import type { Progress } from "../protocol/messages";
import { element } from "./element";

const STAYS_MS = 4000;

export class Jobs {
  readonly box = element("div", { class: "jobs", attributes: { "aria-label": "Work in the background" } });
  private readonly jobs = new Map<string, { row: HTMLElement; bar: HTMLProgressElement; what: HTMLElement; timer: number }>();

  take(progress: Progress): void {
    let job = this.jobs.get(progress.job);
    if (job === undefined) {
      const bar = element("progress", { attributes: { max: "1", "aria-label": progress.job } });
      const what = element("span", { class: "what" });
      const row = element("div", { class: "job" }, element("span", { class: "name", text: progress.job }), what, bar);
      job = { row, bar, what, timer: 0 };
      this.jobs.set(progress.job, job);
      this.box.append(row);
    }
    window.clearTimeout(job.timer);
    job.what.textContent = progress.done === true ? "done" : (progress.what ?? "");
    if (progress.done === true) job.bar.value = 1;
    else if (typeof progress.share === "number") job.bar.value = Math.min(1, Math.max(0, progress.share));
    else job.bar.removeAttribute("value");
    if (progress.done === true) job.timer = window.setTimeout(() => this.drop(progress.job), STAYS_MS);
  }

  private drop(name: string): void {
    this.jobs.get(name)?.row.remove();
    this.jobs.delete(name);
  }

  forget(): void {
    for (const name of [...this.jobs.keys()]) this.drop(name);
  }
}
