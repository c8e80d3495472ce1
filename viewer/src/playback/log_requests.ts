// HTTP requests for the frames and time series of a log.

import { fetchBytes } from "../protocol/urls";
import type { Series } from "../protocol/messages";
import { splitFrames } from "../protocol/frame";

export async function fetchFrames(log: number, from: number, count: number): Promise<ArrayBuffer[]> {
  const path = `log/${log}/frames?from=${from}&count=${count}`;
  return splitFrames(await fetchBytes(path, new AbortController().signal, () => undefined));
}

export async function fetchSeries(log: number): Promise<Series> {
  const bytes = await fetchBytes(`log/${log}/series`, new AbortController().signal, () => undefined);
  const series = JSON.parse(new TextDecoder().decode(bytes)) as Partial<Series>;
  if (!Array.isArray(series.t) || !Array.isArray(series.devices) || typeof series.energy !== "object") {
    throw new Error(`series of log ${log} cannot be read`);
  }
  return series as Series;
}
