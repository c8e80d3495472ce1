// The panels with what is measured: forces, energies, the timing of the force process, the accuracy.

import { count, digits, micros, withUnit } from "../format";
import type { SceneMessage, Series, Status } from "../protocol/messages";
import { ENERGY_NAMES, type Picture } from "../protocol/picture";
import { element, section } from "./element";
import { ENERGY_LINES, energyOf, fromLowest, History } from "./history";
import { Plot } from "./plots";

const SHOWN_S = 10;
const DRAWN_EVERY_MS = 60;

function forceLines(scene: SceneMessage): { name: string; title: string }[] {
  return scene.devices.map(({ name }) => ({ name, title: `Force on ${name}` }));
}

export class PlotPanels {
  readonly history = new History(SHOWN_S);
  readonly force = new Plot("N", 150, []);
  readonly energy = new Plot("J", 170, ENERGY_LINES);
  private readonly balance = element("p", { class: "quiet" });
  readonly sections: HTMLElement[];
  private drawnAt = 0;
  private latest: Picture | null = null;

  constructor(prefix = "") {
    const named = (text: string) => (prefix === "" ? text : `${prefix}: ${text.toLowerCase()}`);
    this.sections = [
      section(named("Force on the fingers"), true, this.force.box),
      section(named("Energy"), true, this.energy.box, this.balance),
    ];
    for (const part of this.sections) part.addEventListener("toggle", () => this.draw());
  }

  begin(scene: SceneMessage): void {
    this.history.begin(scene.devices.length);
    this.force.begin(forceLines(scene));
    this.energy.begin();
  }

  /** With the colours of the page as they are now. */
  dress(): void {
    this.force.begin();
    this.energy.begin();
  }

  take(picture: Picture): void {
    this.history.take(picture);
    this.latest = picture;
  }

  frame(now: number): void {
    if (now - this.drawnAt < DRAWN_EVERY_MS || this.latest === null) return;
    this.drawnAt = now;
    this.draw();
  }

  private draw(): void {
    const picture = this.latest;
    if (picture === null) return;
    const { times, forces, energies } = this.history;
    const shown: [number, number] = [Math.max(0, picture.time - SHOWN_S), Math.max(SHOWN_S, picture.time)];
    this.force.show([times, ...forces], shown);
    this.energy.show([times, ...energies.map((line, i) => (ENERGY_LINES[i].name === "Height" ? fromLowest(line) : line))], shown);
    this.sayBalance(picture.energies);
  }

  private sayBalance(energies: Float32Array): void {
    const defect = energyOf(energies, ["defect"]);
    this.balance.textContent = `Books balance to ${withUnit(Math.abs(defect), "J", 0, 2)}.`;
    this.balance.title = "Work of the hands less what is stored and lost: what the computation made up or mislaid";
  }

  /** All of a log at once. */
  showSeries(series: Series): void {
    this.force.begin(series.devices.map(({ name }) => ({ name, title: `Force on ${name}` })));
    this.force.show([series.t, ...series.devices.map(({ force }) => force)], null);
    this.energy.begin();
    const zero = series.t.map(() => 0);
    const lines = ENERGY_LINES.map((line) => {
      const parts = line.of.map((name) => series.energy[name] ?? zero);
      const sum = zero.map((_, i) => parts.reduce((all, part) => all + part[i], 0));
      return line.name === "Height" ? fromLowest(sum) : sum;
    });
    this.energy.show([series.t, ...lines], null);
    const defect = series.energy.defect?.at(-1);
    if (defect !== undefined) this.sayBalance(Float32Array.from(ENERGY_NAMES, (name) => (name === "defect" ? defect : 0)));
  }
}

export class TimingPanel {
  private readonly rows = element("tbody");
  private readonly facts = element("p", { class: "quiet" });
  readonly section = section(
    "Timing of the force",
    true,
    element(
      "table",
      { class: "timing" },
      element(
        "thead",
        {},
        element(
          "tr",
          {},
          element("th", { attributes: { scope: "col" } }),
          ...(
            [
              ["half", "Half of the steps are faster (median)"],
              ["99 %", "One step in 100 is slower"],
              ["99.9 %", "One step in 1000 is slower"],
              ["worst", "The slowest step so far"],
            ] as const
          ).map(([text, title]) => element("th", { text, title, attributes: { scope: "col" } })),
        ),
      ),
      this.rows,
    ),
    this.facts,
  );

  take(status: Status): void {
    const timing = status.force_process ?? null;
    this.section.hidden = timing === null;
    if (timing === null) return;
    const row = (name: string, title: string, values: Status["force_process"] extends infer F ? (F extends { compute_us: infer P } ? P : never) : never) =>
      element(
        "tr",
        {},
        element("th", { text: name, title, attributes: { scope: "row" } }),
        ...[values.p50, values.p99, values.p999, values.max].map((value) => element("td", { text: micros(value) })),
      );
    this.rows.replaceChildren(
      row("takes", "How long the computation of one step takes", timing.compute_us),
      row("begins late by", "How long after its time a step begins: that is the machine's doing", timing.late_us),
    );
    const missed = timing.overruns === 0 ? "no step was late" : `${count(timing.overruns)} late, ${count(timing.own_overruns)} of them its own doing`;
    this.facts.textContent = `${count(status.steps)} steps, ${missed}. ${timing.priority ? "With" : "Without"} real-time priority.`;
    this.facts.title = "A step is late if its force came after the next one should have begun (overrun)";
  }

  clear(): void {
    this.section.hidden = true;
  }
}

export class AccuracyPanel {
  private readonly list = element("div", { class: "accuracy" });
  readonly section = section("Accuracy", false, this.list);

  take(scenes: readonly SceneMessage[]): void {
    this.list.replaceChildren(
      ...scenes.flatMap((scene) =>
        scene.objects.map((object) =>
          element(
            "article",
            {},
            element("h3", { text: object.name }),
            element("p", {
              class: "quiet",
              text: `${count(object.nodes)} places on the surface, ${count(object.modes)} modes, ${withUnit(1000 * object.mass, "g")}${materialText(object.material)}`,
            }),
            element("ul", {}, ...object.certificate.map((line) => element("li", { text: String(line) }))),
          ),
        ),
      ),
    );
    this.section.title = "What the recording states of its own error, against the full finite element model";
  }
}

function materialText(material: SceneMessage["objects"][number]["material"]): string {
  if (material === null || material === undefined) return "";
  return `; ${withUnit(material.young, "Pa")}, Poisson's ratio ${digits(material.poisson)}, ${digits(material.density)} kg/m³`;
}
