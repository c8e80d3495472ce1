// Film of the scene view: both canvases on a third one, whose stream a MediaRecorder encodes, with the sound of the scene.

import type { SceneView } from "../rendering/scene_view";
import { withDuration } from "./webm_duration";

/** Longest film [s]. */
export const LONGEST_S = 180;
/** Largest film [bytes]: it is kept in memory until it ends. */
export const LARGEST_BYTES = 200e6;

const FRAME_RATE = 30;
const BITS_PER_SECOND = 8e6;
/** Longest side of the picture [px]. */
const LONGEST_SIDE = 1920;
/** Interval at which the recorder hands over what it has encoded [ms]. */
const SLICE_MS = 1000;

/** VP8 first: where the processor encodes, VP9 takes several times as long, and falls behind beside a scene. */
const TYPES = ["video/webm;codecs=vp8,opus", "video/webm;codecs=vp9,opus", "video/webm", "video/mp4"];

/** Sound for a film, which gives it back at its end. */
export interface FilmSound {
  track: MediaStreamTrack;
  release(): void;
}

/** Finished film. */
export interface FilmFile {
  data: Blob;
  seconds: number;
  /** Whether it ended at its largest length or size. */
  full: boolean;
}

/** Type of film that this browser records; null if it records none. */
export function filmType(): string | null {
  if (typeof MediaRecorder === "undefined" || typeof HTMLCanvasElement.prototype.captureStream !== "function") return null;
  return TYPES.find((type) => MediaRecorder.isTypeSupported(type)) ?? null;
}

/** Ending of the file name of a film. */
export function fileEnding(type: string): string {
  return type.startsWith("video/mp4") ? "mp4" : "webm";
}

/** Film that is being recorded, from its construction on. */
export class Film {
  private readonly picture = document.createElement("canvas");
  private readonly context: CanvasRenderingContext2D;
  private readonly recorder: MediaRecorder;
  private readonly parts: Blob[] = [];
  private bytes = 0;
  /** Length up to the last pause [ms], and begin of the part since then. */
  private recorded = 0;
  private since: number | null = performance.now();
  private drawnAt = Number.NEGATIVE_INFINITY;
  private full = false;

  /** Throws where the browser records no film; `sound` is null for a silent one; `onEnd` gets the film, or why there is none. */
  constructor(
    private readonly sceneView: SceneView,
    readonly type: string,
    private readonly sound: FilmSound | null,
    private readonly onEnd: (film: FilmFile | string) => void,
  ) {
    const { width, height } = sceneView.canvas;
    const scale = Math.min(1, LONGEST_SIDE / Math.max(width, height));
    // Encoders want even sides.
    this.picture.width = Math.max(2, 2 * Math.round((scale * width) / 2));
    this.picture.height = Math.max(2, 2 * Math.round((scale * height) / 2));
    const context = this.picture.getContext("2d", { alpha: false });
    if (context === null) throw new Error("this browser offers no 2D canvas");
    this.context = context;
    const stream = this.picture.captureStream(FRAME_RATE);
    if (sound !== null) stream.addTrack(sound.track);
    this.recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: BITS_PER_SECOND });
    this.recorder.ondataavailable = ({ data }) => this.keep(data);
    // Also after an error of the encoder, with what there is.
    this.recorder.onstop = () => void this.finish();
    this.recorder.start(SLICE_MS);
    sceneView.drawn = () => this.addFrame();
    sceneView.requestRender();
  }

  /** Length so far [s]. */
  get seconds(): number {
    return (this.recorded + (this.since === null ? 0 : performance.now() - this.since)) / 1000;
  }

  /** Once per animation frame: a scene that stands still is filmed, too. */
  animate(): void {
    if (this.recorder.state !== "recording") return;
    if (this.seconds >= LONGEST_S) {
      this.full = true;
      this.stop();
    }
    this.sceneView.requestRender();
  }

  /** A page that nobody sees draws nothing: its time is left out. */
  hidden(hidden: boolean): void {
    if (hidden && this.recorder.state === "recording") {
      this.hold();
      this.recorder.pause();
    } else if (!hidden && this.recorder.state === "paused") {
      this.since = performance.now();
      this.recorder.resume();
    }
  }

  stop(): void {
    if (this.recorder.state === "inactive") return;
    this.hold();
    this.recorder.stop();
  }

  private hold(): void {
    this.recorded = 1000 * this.seconds;
    this.since = null;
  }

  private addFrame(): void {
    const now = performance.now();
    // The screen's rate may be a little below twice that of the film.
    if (this.recorder.state !== "recording" || now - this.drawnAt < 750 / FRAME_RATE) return;
    this.drawnAt = now;
    const { context, picture, sceneView } = this;
    const { canvas, overlay } = sceneView;
    // A window of another size is shown whole, in the middle.
    const scale = Math.min(picture.width / canvas.width, picture.height / canvas.height);
    const [width, height] = [scale * canvas.width, scale * canvas.height];
    const [x, y] = [(picture.width - width) / 2, (picture.height - height) / 2];
    context.fillStyle = sceneView.palette.background;
    context.fillRect(0, 0, picture.width, picture.height);
    context.drawImage(canvas, x, y, width, height);
    context.drawImage(overlay, x, y, width, height);
  }

  private keep(data: Blob): void {
    if (data.size === 0) return;
    this.parts.push(data);
    this.bytes += data.size;
    if (this.bytes < LARGEST_BYTES || this.recorder.state === "inactive") return;
    this.full = true;
    this.stop();
  }

  private async finish(): Promise<void> {
    if (this.parts.length === 0) {
      this.end("the browser encoded no picture");
      return;
    }
    const data = new Blob(this.parts, { type: this.type.split(";")[0] });
    const { seconds, full } = this;
    this.end({ data: await withDuration(data, seconds).catch(() => data), seconds, full });
  }

  private end(film: FilmFile | string): void {
    this.sceneView.drawn = null;
    this.recorder.onstop = this.recorder.ondataavailable = null;
    if (this.recorder.state !== "inactive") this.recorder.stop();
    for (const track of this.recorder.stream.getTracks()) track.stop();
    this.sound?.release();
    this.onEnd(film);
  }
}
