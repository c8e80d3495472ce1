// Lines over time, by uPlot, in the colours of the page.

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { withUnit } from "../format";
import { element } from "./element";

const LINE_COLOURS = ["--line-1", "--line-2", "--line-3", "--line-4", "--line-5", "--line-6"];

export class Plot {
  private readonly canvas = element("div", { class: "plot" });
  private readonly legend = element("ul", { class: "legend" });
  readonly box = element("div", {}, this.canvas, this.legend);
  private readonly readings: HTMLElement[] = [];
  private plot: uPlot | null = null;
  private data: uPlot.AlignedData = [[]];
  private window: [number, number] | null = null;
  private cursorAt: number | null = null;
  onSeek: ((time: number) => void) | null = null;

  constructor(
    private readonly unit: string,
    private readonly height: number,
    private lines: readonly { name: string; title: string }[],
  ) {
    new ResizeObserver(() => this.fit()).observe(this.canvas);
  }

  /** New lines, or new colours. */
  begin(lines = this.lines): void {
    this.lines = lines;
    this.plot?.destroy();
    this.plot = null;
    this.readings.length = 0;
    this.legend.replaceChildren(
      ...lines.map(({ name, title }, i) => {
        const mark = element("i");
        mark.style.background = `var(${LINE_COLOURS[i % LINE_COLOURS.length]})`;
        const reading = element("b");
        this.readings.push(reading);
        return element("li", { title }, mark, element("span", { class: "name", text: name }), reading);
      }),
    );
    this.draw();
  }

  /** Says the values where the cursor is, else at the marked time, else the last ones. */
  private read(): void {
    const times = this.data[0];
    let at = this.plot?.cursor.idx ?? null;
    if (at === null && this.cursorAt !== null) at = nearest(times, this.cursorAt);
    at ??= times.length - 1;
    this.readings.forEach((reading, i) => {
      const value = this.data[i + 1]?.[at];
      reading.textContent = value == null ? "" : withUnit(value, this.unit, 1e-7);
    });
  }

  show(data: readonly (readonly number[])[], window: [number, number] | null): void {
    this.data = data as unknown as uPlot.AlignedData;
    this.window = window;
    this.draw();
  }

  /** A line at a time of a log. */
  mark(time: number | null): void {
    this.cursorAt = time;
    this.plot?.redraw(false);
    this.read();
  }

  private draw(): void {
    if (this.canvas.clientWidth < 40 || this.canvas.offsetParent === null) return;
    if (this.data.length !== this.lines.length + 1) return;
    if (this.plot === null) this.make();
    this.plot?.batch((plot: uPlot) => {
      plot.setData(this.data, false);
      const times = this.data[0];
      const [min, max] = this.window ?? [times[0] ?? 0, times[times.length - 1] ?? 1];
      plot.setScale("x", { min, max: Math.max(max, min + 1e-6) });
    });
    this.read();
  }

  private fit(): void {
    const width = this.canvas.clientWidth;
    if (this.plot !== null && width >= 40 && width !== this.plot.width) this.plot.setSize({ width, height: this.height });
    else this.draw();
  }

  private make(): void {
    const style = getComputedStyle(this.canvas);
    const colour = (name: string) => style.getPropertyValue(name).trim();
    const quiet = colour("--quiet");
    const grid = { stroke: colour("--rule"), width: 1 };
    const font = `11px ${style.fontFamily}`;
    this.plot = new uPlot(
      {
        width: this.canvas.clientWidth,
        height: this.height,
        padding: [10, 18, 0, 0],
        cursor: { y: false, drag: { x: false, y: false }, points: { size: 5 } },
        legend: { show: false },
        scales: {
          x: { time: false, auto: false },
          y: { range: (_, min, max) => range(min, max) },
        },
        axes: [
          { stroke: quiet, grid, ticks: { ...grid, size: 4 }, font, size: 26, values: (_, ticks) => ticks.map((t) => `${Number(t.toPrecision(6))} s`), space: 56 },
          {
            stroke: quiet,
            grid,
            ticks: { ...grid, size: 4 },
            font,
            size: 58,
            values: (_, ticks) => axisNumbers(ticks, this.unit),
            space: 26,
          },
        ],
        series: [
          {},
          ...this.lines.map(({ name }, i) => ({
            label: name,
            stroke: colour(LINE_COLOURS[i % LINE_COLOURS.length]),
            width: 1.5,
            points: { show: false },
          })),
        ],
        hooks: { draw: [(plot) => this.drawMark(plot, colour("--accent"))], setCursor: [() => this.read()] },
      },
      this.data,
      this.canvas,
    );
    const plot = this.plot;
    plot.over.addEventListener("click", (event) => this.onSeek?.(plot.posToVal(event.offsetX, "x")));
  }

  private drawMark(plot: uPlot, colour: string): void {
    if (this.cursorAt === null) return;
    const x = Math.round(plot.valToPos(this.cursorAt, "x", true));
    const { left, top, width, height } = plot.bbox;
    if (x < left || x > left + width) return;
    plot.ctx.save();
    plot.ctx.strokeStyle = colour;
    plot.ctx.lineWidth = 2 * devicePixelRatio;
    plot.ctx.beginPath();
    plot.ctx.moveTo(x, top);
    plot.ctx.lineTo(x, top + height);
    plot.ctx.stroke();
    plot.ctx.restore();
  }
}

/** Where in a rising list the number is that is nearest. */
function nearest(times: ArrayLike<number>, time: number): number {
  let [low, high] = [0, times.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle;
  }
  return Math.abs(times[high] - time) < Math.abs(times[low] - time) ? high : low;
}

/** From 0 if all is above, with some room. */
function range(min: number | null, max: number | null): [number, number] {
  const low = Math.min(0, min ?? 0);
  const high = Math.max(0, max ?? 0);
  const room = 0.08 * (high - low) || 1e-3;
  return [low < 0 ? low - room : 0, high + room];
}

/** All ticks of an axis with the same prefix. */
function axisNumbers(ticks: readonly number[], unit: string): string[] {
  const largest = Math.max(...ticks.map(Math.abs));
  const [factor, prefix] = largest >= 1 ? [1, ""] : largest >= 1e-3 ? [1e-3, "m"] : [1e-6, "µ"];
  return ticks.map((tick) => (tick === 0 ? "0" : `${Number((tick / factor).toPrecision(6))} ${prefix}${unit}`.replace("-", "\u2212")));
}
