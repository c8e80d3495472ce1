// Entry point: connects to the server and starts the page mode that its hello message names.

import "./style.css";
import type { PageMode } from "./modes/page_mode";
import { LiveMode } from "./modes/live_mode";
import { LogMode } from "./modes/log_mode";
import { PageLayout } from "./ui/page_layout";
import { helpDialog } from "./ui/help_dialog";
import { DisplayPanel } from "./ui/display_panel";
import { Notifications } from "./ui/notifications";
import { FirstLoad } from "./ui/first_load";
import { scenesAddress, showsLogs } from "./protocol/local_logs";
import { SceneView } from "./rendering/scene_view";
import type { DisplaySettings } from "./rendering/scene_graph";
import { prefersDark, loadPreferences, savePreferences } from "./preferences";
import { token } from "./protocol/token";
import { Connection, type ConnectionListener, type ConnectionState } from "./protocol/connection";
import { runsInWorker, WorkerConnection } from "./protocol/worker_connection";
import type { ServerMessage, Hello } from "./protocol/messages";
import { RenderMode } from "./modes/render_mode";

const PROTOCOL = 2;
const MAX_PIXEL_RATIO = 2;

const notifications = new Notifications();
let themeChosen = false;
let mode: PageMode | null = null;
let modeName: Hello["kind"] | null = null;

function start(): void {
  token();
  const remembered = loadPreferences();
  themeChosen = remembered.themeChosen;
  let sceneView: SceneView;
  try {
    sceneView = new SceneView(remembered);
  } catch {
    document.body.append("This page needs WebGL 2, which this browser does not offer here.");
    return;
  }
  const applyTheme = (display: DisplaySettings) => {
    document.documentElement.dataset.theme = display.dark ? "dark" : "light";
  };
  applyTheme(remembered);
  const display = new DisplayPanel(remembered, (changed, theme) => {
    sceneView.settings = changed;
    themeChosen ||= theme;
    savePreferences(changed, themeChosen);
    applyTheme(changed);
    if (theme) mode?.applyTheme();
    sceneView.requestRender();
  });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    if (themeChosen) return;
    display.set({ dark: prefersDark() });
    mode?.applyTheme();
  });

  let help: HTMLDialogElement | null = null;
  const layout = new PageLayout(sceneView, {
    help: () => help?.showModal(),
    theme: () => display.toggle("dark"),
  });
  layout.overlayTop.append(notifications.banner, notifications.warnings, notifications.list);
  document.body.append(layout.page);

  const fit = () => sceneView.resize(layout.viewArea.clientWidth, layout.viewArea.clientHeight, Math.min(MAX_PIXEL_RATIO, devicePixelRatio || 1));
  const observer = new ResizeObserver(fit);
  observer.observe(layout.viewArea);

  const listener: ConnectionListener = {
    message: (message) => handleMessage(message),
    frame: (frame) => mode?.frameReceived(frame),
    sound: (block) => mode?.soundReceived?.(block),
    state: (state) => showState(state),
    decodeFailed: (what) => notifications.notifyOnce("unreadable", `The server sent a message that this page cannot read; it was dropped (${what}).`),
  };
  const worker = runsInWorker() ? new WorkerConnection({ ...listener, loading: (what, bytes, of) => firstLoad?.show(what, bytes, of) }) : null;
  const connection = worker ?? new Connection(listener);
  let firstLoad = worker === null ? null : new FirstLoad();
  if (firstLoad !== null) layout.viewArea.append(firstLoad.box);

  function handleMessage(message: ServerMessage): void {
    if (message.type === "hello") {
      selectMode(message);
      return;
    }
    if (message.type === "info") notifications.notify(message.text);
    else if (message.type === "error") notifications.notify(message.text, "error");
    else if (message.type === "scene") mode?.scene(message);
    else if (message.type === "status") mode?.status(message);
    else if (message.type === "assigned") mode?.assigned(message);
    else if (message.type === "progress") mode?.progress(message);
  }

  function selectMode(hello: Hello): void {
    firstLoad?.end();
    firstLoad = null;
    if (hello.protocol !== PROTOCOL) {
      notifications.showBanner(`This page speaks protocol ${PROTOCOL}, the server ${hello.protocol}. Reload the page.`, {
        text: "Reload",
        run: () => location.reload(),
      });
      return;
    }
    if (modeName !== null && modeName !== hello.kind) {
      location.reload();
      return;
    }
    if (modeName === null) {
      modeName = hello.kind;
      document.documentElement.dataset.kind = hello.kind;
      if (hello.kind === "render") {
        layout.page.remove();
        observer.disconnect();
        mode = new RenderMode(sceneView);
        mode.hello(hello);
        return;
      }
      help = helpDialog(hello.kind);
      layout.page.append(help);
      mode = hello.kind === "live" ? new LiveMode(sceneView, layout, notifications, display, connection, worker) : new LogMode(sceneView, layout, notifications, display);
      requestAnimationFrame(draw);
    }
    mode?.hello(hello);
  }

  function showState(state: ConnectionState): void {
    if (state.name === "open") {
      notifications.hideBanner();
    } else if (state.name === "lost") {
      mode?.connectionLost();
      const why = state.reason === "" ? "" : ` (${state.reason})`;
      if (worker !== null) showEnd(state.reason, why);
      else notifications.showBanner(`The connection to palpate is lost${why}. Reconnecting …`, { text: "Reconnect now", run: () => connection.retryNow() });
    }
  }

  /** Banner with the reason that the worker has ended, and the way on. */
  function showEnd(reason: string, why: string): void {
    firstLoad?.end();
    if (showsLogs()) notifications.showBanner(`The log cannot be shown: ${reason}`, { text: "Back to the scenes", run: () => window.location.assign(scenesAddress()) });
    else if (mode === null) notifications.showBanner(`The scene could not be loaded: ${reason}. Look at the connection, and load the page again.`, { text: "Load again", run: () => window.location.reload() });
    else notifications.showBanner(`The simulation has ended${why}.`, { text: "Start again", run: () => connection.retryNow() });
  }

  function draw(now: number): void {
    requestAnimationFrame(draw);
    // A headset has a clock of its own.
    if (sceneView.renderer.xr.isPresenting) return;
    mode?.animate(now);
    sceneView.draw(now / 1000);
  }

  document.addEventListener("visibilitychange", () => mode?.visibilityChanged());
  sceneView.canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    sceneView.lost = true;
    notifications.showBanner("The WebGL context was lost. Waiting for it …", null);
  });
  sceneView.canvas.addEventListener("webglcontextrestored", () => {
    sceneView.lost = false;
    notifications.hideBanner();
    mode?.contextRestored();
  });
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target as HTMLElement;
    // A dialog that was just closed may still have the focus.
    const at = target.closest("dialog:not([open])") === null ? target : document.body;
    if (at.closest("input:not([type=radio], [type=checkbox], [type=range]), select, dialog") !== null) return;
    if (event.key === " " && at.closest("button, summary, input") !== null) return;
    const shortcuts: Record<string, () => void> = {
      "?": () => help?.showModal(),
      v: () => sceneView.resetView(),
      c: () => display.nextColour(),
      a: () => display.toggle("arrows"),
      p: () => display.toggle("contactPoints"),
      w: () => display.toggle("wireframe"),
      t: () => display.toggle("dark"),
    };
    if (event.key in shortcuts) shortcuts[event.key]();
    else if (mode?.handleKey(event) !== true) return;
    event.preventDefault();
  });
  // A button that was clicked with a pointer keeps no focus: Space would press it again instead of pausing.
  document.addEventListener("click", (event) => {
    const button = (event.target as HTMLElement).closest("button");
    if (event.detail > 0 && button !== null && button === document.activeElement) button.blur();
  });
  // For tests and the browser's console.
  Object.assign(window, { palpate: { sceneView, connection, notifications } });
  connection.start();
}

start();
