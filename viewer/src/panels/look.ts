// How the picture looks: colours, arrows, lines of the mesh, light or dark.

import type { ColourMode } from "../picture/colours";
import type { Look } from "../picture/world";
import { checkbox, choice, section } from "./element";

const COLOURS: readonly ColourMode[] = ["displacement", "strain", "plain"];

export class LookPanel {
  readonly section: HTMLElement;
  private readonly colour;
  private readonly arrows;
  private readonly wires;
  private readonly dark;

  constructor(
    private look: Look,
    private readonly changed: (look: Look, theme: boolean) => void,
  ) {
    this.colour = choice<ColourMode>(
      "Colour shows",
      [
        { value: "displacement", text: "Motion", title: "How far each place is from where it would be at rest" },
        { value: "strain", text: "Stretch", title: "By how much the surface is stretched or compressed, in the direction where that is most" },
        { value: "plain", text: "Plain", title: "No colours, only light" },
      ],
      (colour) => this.set({ colour }),
    );
    this.arrows = checkbox("Arrows of forces", "Red: on the object. Blue: on your finger. (A)", (arrows) => this.set({ arrows }));
    this.wires = checkbox("Lines of the mesh", "The triangles of the surface (W)", (wires) => this.set({ wires }));
    this.dark = checkbox("Dark", "Light or dark (T)", (dark) => this.set({ dark }, true));
    this.section = section("Picture", true, this.colour.group, this.arrows.row, this.wires.row, this.dark.row);
    this.show();
  }

  set(change: Partial<Look>, theme = false): void {
    this.look = { ...this.look, ...change };
    this.show();
    this.changed(this.look, theme);
  }

  nextColour(): void {
    this.set({ colour: COLOURS[(COLOURS.indexOf(this.look.colour) + 1) % COLOURS.length] });
  }

  toggle(what: "arrows" | "wires" | "dark"): void {
    this.set({ [what]: !this.look[what] }, what === "dark");
  }

  private show(): void {
    this.colour.set(this.look.colour);
    this.arrows.input.checked = this.look.arrows;
    this.wires.input.checked = this.look.wires;
    this.dark.input.checked = this.look.dark;
  }
}
