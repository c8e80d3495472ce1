// HTTP requests for the frames and time series of a log.

import { serverUrl, fetchBytes } from "../protocol/urls";
import type { Series } from "../protocol/messages";
import { splitFrames } from "../protocol/frame";

export async function fetchFrames(log: number, from: number, count: number): Promise<ArrayBuffer[]> {
  const path = `log/${log}/frames?from=${from}&count=${count}`;
  return splitFrames(await fetchBytes(path, new AbortController().signal, () => undefined));
}

export async function fetchSeries(log: number): Promise<Series> {
  const response = await fetch(serverUrl(`log/${log}/series`), { cache: "no-store" });
  if (!response.ok) throw new Error(`series of log ${log}: ${response.status} ${response.statusText}`);
  const series = (await response.json()) as Partial<Series>;
  if (!Array.isArray(series.t) || !Array.isArray(series.devices) || typeof series.energy !== "object") {
    throw new Error(`series of log ${log} cannot be read`);
  }
  return series as Series;
}
