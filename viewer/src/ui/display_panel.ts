// Display settings: colour map, force arrows, wireframe, theme.

import type { ColourMode } from "../rendering/colours";
import type { DisplaySettings } from "../rendering/scene_graph";
import { checkbox, segmentedControl, section } from "./elements";

const COLOURS: readonly ColourMode[] = ["displacement", "strain", "plain"];

export class DisplayPanel {
  readonly section: HTMLElement;
  private readonly colour;
  private readonly arrows;
  private readonly wireframe;
  private readonly dark;

  constructor(
    private settings: DisplaySettings,
    private readonly onChange: (settings: DisplaySettings, theme: boolean) => void,
  ) {
    this.colour = segmentedControl<ColourMode>(
      "Colour by",
      [
        { value: "displacement", text: "Displacement", title: "Distance of each node from its rest position in the body frame" },
        { value: "strain", text: "Strain", title: "Largest principal elongation or compression of the surface" },
        { value: "plain", text: "Plain", title: "Uniform colour" },
      ],
      (colour) => this.set({ colour }),
    );
    this.arrows = checkbox("Force arrows", "Red: on the object. Blue: on your hand. (A)", (arrows) => this.set({ arrows }));
    this.wireframe = checkbox("Wireframe", "The triangles of the surface (W)", (wireframe) => this.set({ wireframe }));
    this.dark = checkbox("Dark theme", "Light or dark theme (T)", (dark) => this.set({ dark }, true));
    this.section = section("Display", true, this.colour.group, this.arrows.row, this.wireframe.row, this.dark.row);
    this.show();
  }

  set(change: Partial<DisplaySettings>, theme = false): void {
    this.settings = { ...this.settings, ...change };
    this.show();
    this.onChange(this.settings, theme);
  }

  nextColour(): void {
    this.set({ colour: COLOURS[(COLOURS.indexOf(this.settings.colour) + 1) % COLOURS.length] });
  }

  toggle(setting: "arrows" | "wireframe" | "dark"): void {
    this.set({ [setting]: !this.settings[setting] }, setting === "dark");
  }

  private show(): void {
    this.colour.set(this.settings.colour);
    this.arrows.input.checked = this.settings.arrows;
    this.wireframe.input.checked = this.settings.wireframe;
    this.dark.input.checked = this.settings.dark;
  }
}
