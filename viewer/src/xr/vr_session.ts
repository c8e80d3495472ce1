// VR session: the button that enters it where a headset is there, the loop that draws for it, and the tips of hands or controllers.

import { Object3D, PerspectiveCamera, Vector3 } from "three";
import type { SceneView } from "../rendering/scene_view";
import { iconButton } from "../ui/elements";
import type { Notifications } from "../ui/notifications";
import type { VrHands } from "./vr_hands";
import { sceneFromRoom } from "./vr_stage";

/** Nearest and farthest distance that a headset shows [m]. */
const CLIP = { near: 0.02, far: 50 };
const HANDS = ["left", "right"] as const;

/** Whether the page may ask for a headset: in a frame of another origin it may not, and Chromium reports an error when it does. */
function mayAskForHeadset(): boolean {
  const { featurePolicy } = document as { featurePolicy?: { allowsFeature(name: string): boolean } };
  return featurePolicy?.allowsFeature("xr-spatial-tracking") ?? true;
}

export class VrSession {
  readonly button = iconButton("headset", "Enter VR", () => void this.toggle(), "VR");
  private session: XRSession | null = null;
  /** Frame of the room in the scene. */
  private readonly stage = new Object3D();
  private readonly camera = new PerspectiveCamera(60, 1, CLIP.near, CLIP.far);

  /** `animate` moves the page on, with a time [ms]; `onBegin` is called when the headset shows the scene. */
  constructor(
    private readonly sceneView: SceneView,
    private readonly hands: VrHands,
    private readonly notifications: Notifications,
    private readonly animate: (now: number) => void,
    private readonly onBegin: () => void,
  ) {
    this.stage.matrixAutoUpdate = false;
    this.stage.add(this.camera);
    this.button.hidden = true;
    if (!mayAskForHeadset()) return;
    navigator.xr?.isSessionSupported("immersive-vr").then(
      (supported) => {
        this.button.hidden = !supported;
      },
      () => undefined,
    );
  }

  private async toggle(): Promise<void> {
    if (this.session !== null) {
      await this.session.end();
      return;
    }
    try {
      const session = await navigator.xr?.requestSession("immersive-vr", { optionalFeatures: ["local-floor", "hand-tracking"] });
      if (session === undefined) return;
      this.session = session;
      session.addEventListener("end", () => this.ended());
      const { renderer } = this.sceneView;
      renderer.xr.enabled = true;
      renderer.setScissorTest(false);
      await renderer.xr.setSession(session);
      renderer.setAnimationLoop((now, frame) => this.draw(now, frame));
      this.show("Leave VR");
      this.onBegin();
    } catch (error) {
      await this.session?.end();
      this.notifications.notify(`VR cannot begin: ${error instanceof Error ? error.message : String(error)}`, "error");
    }
  }

  private ended(): void {
    const { sceneView } = this;
    this.session = null;
    this.hands.end();
    sceneView.renderer.setAnimationLoop(null);
    sceneView.renderer.xr.enabled = false;
    this.show("Enter VR");
    sceneView.requestRender();
  }

  private show(title: string): void {
    this.button.title = title;
    this.button.setAttribute("aria-label", title);
  }

  private draw(now: number, frame: XRFrame | undefined): void {
    const { sceneView, stage } = this;
    const { center, radius } = sceneView.graphs[0]?.info.view ?? { center: [0, 0, 0] as const, radius: 0.1 };
    const { up, viewDirection } = sceneView.orbit;
    stage.matrix.copy(sceneFromRoom(new Vector3(...center), radius, up, viewDirection.negate()));
    stage.updateMatrixWorld(true);
    if (frame !== undefined) this.hands.move(this.tips(frame));
    this.animate(now);
    sceneView.drawImmersive(this.camera, now / 1000);
  }

  /** Tips of the index fingers, or of the controllers, in the scene; null for a hand that is not tracked. */
  private tips(frame: XRFrame): (Vector3 | null)[] {
    const room = this.sceneView.renderer.xr.getReferenceSpace();
    return HANDS.map((handedness) => {
      const source = [...frame.session.inputSources].find((candidate) => candidate.handedness === handedness);
      if (source === undefined || room === null) return null;
      const joint = source.hand?.get("index-finger-tip");
      const pose = joint === undefined ? frame.getPose(source.targetRaySpace, room) : frame.getJointPose?.(joint, room);
      if (pose == null) return null;
      const { x, y, z } = pose.transform.position;
      return new Vector3(x, y, z).applyMatrix4(this.stage.matrixWorld);
    });
  }
}
