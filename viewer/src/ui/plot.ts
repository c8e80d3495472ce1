// Line plot over time (uPlot) with a legend, in the theme's colours.

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { withUnit } from "../format";
import { element } from "./elements";

const SERIES_COLOURS = ["--series-1", "--series-2", "--series-3", "--series-4", "--series-5", "--series-6"];

/** Curve of a plot. */
export interface PlotSeries {
  name: string;
  title: string;
  dashed?: boolean;
}

export class Plot {
  private readonly canvas = element("div", { class: "plot", role: "img" });
  private readonly legend = element("ul", { class: "legend" });
  readonly box = element("div", {}, this.canvas, this.legend);
  private readonly valueLabels: HTMLElement[] = [];
  private plot: uPlot | null = null;
  private data: uPlot.AlignedData = [[]];
  private window: [number, number] | null = null;
  private markerTime: number | null = null;
  onSeek: ((time: number) => void) | null = null;

  constructor(
    private readonly unit: string,
    private readonly height: number,
    private series: readonly PlotSeries[],
  ) {
    new ResizeObserver(() => this.resize()).observe(this.canvas);
  }

  /** Sets the series, or rebuilds the plot with the current theme. */
  setSeries(series = this.series): void {
    this.series = series;
    this.canvas.setAttribute("aria-label", `Plot over time in ${this.unit}: ${series.map(({ name }) => name).join(", ")}`);
    this.plot?.destroy();
    this.plot = null;
    this.valueLabels.length = 0;
    this.legend.replaceChildren(
      ...series.map(({ name, title, dashed }, i) => {
        const swatch = element("i", { class: dashed === true ? "dashed" : "" });
        swatch.style.color = `var(${SERIES_COLOURS[i % SERIES_COLOURS.length]})`;
        const label = element("b");
        this.valueLabels.push(label);
        return element("li", { title }, swatch, element("span", { class: "name", text: name }), label);
      }),
    );
    this.draw();
  }

  /** Shows the values at the cursor, else at the marker, else the last ones. */
  private updateLegend(): void {
    const times = this.data[0];
    let at = this.plot?.cursor.idx ?? null;
    if (at === null && this.markerTime !== null) at = nearest(times, this.markerTime);
    at ??= times.length - 1;
    this.valueLabels.forEach((label, i) => {
      const value = this.data[i + 1]?.[at];
      label.textContent = value == null ? "" : withUnit(value, this.unit, 1e-7);
    });
  }

  setData(data: readonly (readonly (number | null)[])[], window: [number, number] | null): void {
    this.data = data as unknown as uPlot.AlignedData;
    this.window = window;
    this.draw();
  }

  /** Sets the vertical marker [s]. */
  setMarker(time: number | null): void {
    this.markerTime = time;
    this.plot?.redraw(false);
    this.updateLegend();
  }

  private draw(): void {
    if (this.canvas.clientWidth < 40 || this.canvas.offsetParent === null) return;
    if (this.data.length !== this.series.length + 1) return;
    if (this.plot === null) this.create();
    this.plot?.batch((plot: uPlot) => {
      plot.setData(this.data, false);
      const times = this.data[0];
      const [min, max] = this.window ?? [times[0] ?? 0, times[times.length - 1] ?? 1];
      plot.setScale("x", { min, max: Math.max(max, min + 1e-6) });
    });
    this.updateLegend();
  }

  private resize(): void {
    const width = this.canvas.clientWidth;
    if (this.plot !== null && width >= 40 && width !== this.plot.width) this.plot.setSize({ width, height: this.height });
    else this.draw();
  }

  private create(): void {
    const style = getComputedStyle(this.canvas);
    const colour = (name: string) => style.getPropertyValue(name).trim();
    const textColour = colour("--text-secondary");
    const grid = { stroke: colour("--border"), width: 1 };
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
          y: { range: (_, min, max) => paddedRange(min, max) },
        },
        axes: [
          { stroke: textColour, grid, ticks: { ...grid, size: 4 }, font, size: 26, values: (_, ticks) => ticks.map((t) => `${Number(t.toPrecision(6))} s`), space: 56 },
          {
            stroke: textColour,
            grid,
            ticks: { ...grid, size: 4 },
            font,
            size: 58,
            values: (_, ticks) => axisLabels(ticks, this.unit),
            space: 26,
          },
        ],
        series: [
          {},
          ...this.series.map(({ name, dashed }, i) => ({
            label: name,
            ...(dashed === true ? { dash: [6, 4] } : {}),
            stroke: colour(SERIES_COLOURS[i % SERIES_COLOURS.length]),
            width: 1.5,
            points: { show: false },
          })),
        ],
        hooks: { draw: [(plot) => this.drawMarker(plot, colour("--accent"))], setCursor: [() => this.updateLegend()] },
      },
      this.data,
      this.canvas,
    );
    const plot = this.plot;
    // A press seeks, a drag scrubs.
    const seek = (event: PointerEvent) => this.onSeek?.(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
    plot.over.addEventListener("pointerdown", (event) => {
      if (this.onSeek === null || event.button !== 0) return;
      plot.over.setPointerCapture(event.pointerId);
      seek(event);
    });
    plot.over.addEventListener("pointermove", (event) => {
      if (plot.over.hasPointerCapture(event.pointerId)) seek(event);
    });
    plot.over.classList.toggle("seekable", this.onSeek !== null);
  }

  private drawMarker(plot: uPlot, colour: string): void {
    if (this.markerTime === null) return;
    const x = Math.round(plot.valToPos(this.markerTime, "x", true));
    const { left, top, width, height } = plot.bbox;
    if (x < left || x > left + width) return;
    plot.ctx.save();
    plot.ctx.strokeStyle = colour;
    plot.ctx.lineWidth = 2 * devicePixelRatio;
    plot.ctx.setLineDash([]);
    plot.ctx.beginPath();
    plot.ctx.moveTo(x, top);
    plot.ctx.lineTo(x, top + height);
    plot.ctx.stroke();
    plot.ctx.restore();
  }
}

/** Index of the nearest value in a sorted list. */
function nearest(times: ArrayLike<number>, time: number): number {
  let [low, high] = [0, times.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle;
  }
  return Math.abs(times[high] - time) < Math.abs(times[low] - time) ? high : low;
}

/** Axis range that includes 0, with padding. */
function paddedRange(min: number | null, max: number | null): [number, number] {
  const low = Math.min(0, min ?? 0);
  const high = Math.max(0, max ?? 0);
  const room = 0.08 * (high - low) || 1e-3;
  return [low < 0 ? low - room : 0, high + room];
}

/** Tick labels with a common SI prefix. */
function axisLabels(ticks: readonly number[], unit: string): string[] {
  const largest = Math.max(...ticks.map(Math.abs));
  const [factor, prefix] = largest >= 1 ? [1, ""] : largest >= 1e-3 ? [1e-3, "m"] : [1e-6, "µ"];
  return ticks.map((tick) => (tick === 0 ? "0" : `${Number((tick / factor).toPrecision(6))} ${prefix}${unit}`.replace("-", "\u2212")));
}
