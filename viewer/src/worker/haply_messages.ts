// Messages between the worker of a scene and that of its Haply device.

import type { Reading, Vector } from "./haply_device";

/** To the device: connect by an address, a force [N, device frame] for a reading, or take the force away and end. */
export type ToHaply = { kind: "connect"; address: string } | { kind: "force"; number: number; force: Vector } | { kind: "close" };

/** From the device: its name, a numbered reading that waits for a force, or why the connection is lost; it is tried again. */
export type FromHaply = { kind: "connected"; device: string } | { kind: "reading"; number: number; reading: Reading | null } | { kind: "lost"; reason: string };
