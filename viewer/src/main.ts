// The page: waits for what the server says it is, and becomes that.

import "./style.css";
import type { Kind } from "./kind";
import { Live } from "./live";
import { Logs } from "./logs";
import { Frame } from "./panels/frame";
import { helpSheet } from "./panels/help";
import { LookPanel } from "./panels/look";
import { Notes } from "./panels/notes";
import { Stage } from "./picture/stage";
import type { Look } from "./picture/world";
import { prefersDark, rememberedLook, rememberLook } from "./preferences";
import { Connection, type ConnectionState } from "./protocol/connection";
import type { FromServer, Hello } from "./protocol/messages";
import { Render } from "./render";

const PROTOCOL = 1;
const MOST_RATIO = 2;

const notes = new Notes();
let themeChosen = false;
let kind: Kind | null = null;
let kindName: Hello["kind"] | null = null;

function start(): void {
  const remembered = rememberedLook();
  themeChosen = remembered.themeChosen;
  let stage: Stage;
  try {
    stage = new Stage(remembered);
  } catch {
    document.body.append("This page needs WebGL 2, which this browser does not offer here.");
    return;
  }
  const applyTheme = (look: Look) => {
    document.documentElement.dataset.theme = look.dark ? "dark" : "light";
  };
  applyTheme(remembered);
  const look = new LookPanel(remembered, (changed, theme) => {
    stage.look = changed;
    themeChosen ||= theme;
    rememberLook(changed, themeChosen);
    applyTheme(changed);
    if (theme) kind?.dress();
    stage.redraw();
  });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    if (themeChosen) return;
    look.set({ dark: prefersDark() });
    kind?.dress();
  });

  let help: HTMLDialogElement | null = null;
  const frame = new Frame(stage, {
    help: () => help?.showModal(),
    theme: () => look.toggle("dark"),
  });
  frame.upper.append(notes.banner, notes.list);
  document.body.append(frame.page);

  const fit = () => stage.resize(frame.stageArea.clientWidth, frame.stageArea.clientHeight, Math.min(MOST_RATIO, devicePixelRatio || 1));
  const observer = new ResizeObserver(fit);
  observer.observe(frame.stageArea);

  const connection = new Connection({
    message: (message) => hear(message),
    picture: (picture) => kind?.pictureCame(picture),
    state: (state) => showState(state),
    unreadable: (what) => notes.sayOnce("unreadable", `The server sent something that this page cannot read; it was dropped (${what}).`),
  });

  function hear(message: FromServer): void {
    if (message.type === "hello") {
      become(message);
      return;
    }
    if (message.type === "note") notes.say(message.text);
    else if (message.type === "error") notes.say(message.text, "error");
    else if (message.type === "scene") kind?.scene(message);
    else if (message.type === "status") kind?.status(message);
    else if (message.type === "granted") kind?.granted(message);
    else if (message.type === "progress") kind?.progress(message);
  }

  function become(hello: Hello): void {
    if (hello.protocol !== PROTOCOL) {
      notes.showBanner(`This page speaks protocol ${PROTOCOL}, the server ${hello.protocol}. Loading the page again may help.`, {
        text: "Load again",
        act: () => location.reload(),
      });
      return;
    }
    if (kindName !== null && kindName !== hello.kind) {
      location.reload();
      return;
    }
    if (kindName === null) {
      kindName = hello.kind;
      document.documentElement.dataset.kind = hello.kind;
      if (hello.kind === "render") {
        frame.page.remove();
        observer.disconnect();
        kind = new Render(stage);
        kind.hello(hello);
        return;
      }
      help = helpSheet(hello.kind);
      frame.page.append(help);
      kind = hello.kind === "live" ? new Live(stage, frame, notes, look, connection) : new Logs(stage, frame, notes, look);
      requestAnimationFrame(draw);
    }
    kind?.hello(hello);
  }

  function showState(state: ConnectionState): void {
    if (state.name === "open") {
      notes.hideBanner();
    } else if (state.name === "lost") {
      kind?.lost();
      const why = state.reason === "" ? "" : ` (${state.reason})`;
      notes.showBanner(`The connection to palpate is lost${why}. Trying again by itself …`, { text: "Now", act: () => connection.retryNow() });
    }
  }

  function draw(now: number): void {
    requestAnimationFrame(draw);
    kind?.frame(now);
    stage.draw(now / 1000);
  }

  document.addEventListener("visibilitychange", () => kind?.visibility());
  stage.canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    stage.lost = true;
    notes.showBanner("The graphics card was reset. Waiting for it …", null);
  });
  stage.canvas.addEventListener("webglcontextrestored", () => {
    stage.lost = false;
    notes.hideBanner();
    kind?.reload();
  });
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target as HTMLElement;
    // A sheet that was just closed may still have the focus.
    const at = target.closest("dialog:not([open])") === null ? target : document.body;
    if (at.closest("input:not([type=radio], [type=checkbox], [type=range]), select, dialog") !== null) return;
    if (event.key === " " && at.closest("button, summary, input") !== null) return;
    const acts: Record<string, () => void> = {
      "?": () => help?.showModal(),
      v: () => stage.home(),
      c: () => look.nextColour(),
      a: () => look.toggle("arrows"),
      w: () => look.toggle("wires"),
      t: () => look.toggle("dark"),
    };
    if (event.key in acts) acts[event.key]();
    else if (kind?.key(event) !== true) return;
    event.preventDefault();
  });
  // For tests, and for those who look with the browser's tools.
  Object.assign(window, { palpate: { stage, connection, notes } });
  connection.begin();
}

start();
