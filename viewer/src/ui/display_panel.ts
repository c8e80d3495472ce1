// Display settings: colour map, force vectors, contact points, wireframe, theme.

import type { ColourMode } from "../rendering/colours";
import type { DisplaySettings } from "../rendering/scene_graph";
import { checkbox, segmentedControl, section } from "./elements";

const COLOURS: readonly ColourMode[] = ["plain", "displacement", "strain"];

export class DisplayPanel {
  readonly section: HTMLElement;
  private readonly colour;
  private readonly arrows;
  private readonly contactPoints;
  private readonly wireframe;
  private readonly dark;

  constructor(
    private settings: DisplaySettings,
    private readonly onChange: (settings: DisplaySettings, theme: boolean) => void,
  ) {
    this.colour = segmentedControl<ColourMode>(
      "Colour by",
      [
        { value: "plain", text: "Material", title: "Look of the material" },
        { value: "displacement", text: "Displacement", title: "Distance of each node from its rest position in the body frame" },
        { value: "strain", text: "Max. principal strain", title: "Of the surface, elongation or compression" },
      ],
      (colour) => this.set({ colour }),
    );
    this.arrows = checkbox("Force vectors", "Red: on the object. Blue: on your hand. (A)", (arrows) => this.set({ arrows }));
    this.contactPoints = checkbox("Contact points", "Every contact, with its own force vector (P)", (contactPoints) => this.set({ contactPoints }));
    this.wireframe = checkbox("Wireframe", "The triangles of the surface (W)", (wireframe) => this.set({ wireframe }));
    this.dark = checkbox("Dark theme", "Light or dark theme (T)", (dark) => this.set({ dark }, true));
    this.section = section("Display", true, this.colour.group, this.arrows.row, this.contactPoints.row, this.wireframe.row, this.dark.row);
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

  toggle(setting: "arrows" | "contactPoints" | "wireframe" | "dark"): void {
    this.set({ [setting]: !this.settings[setting] }, setting === "dark");
  }

  private show(): void {
    this.colour.set(this.settings.colour);
    this.arrows.input.checked = this.settings.arrows;
    this.contactPoints.input.checked = this.settings.contactPoints;
    this.wireframe.input.checked = this.settings.wireframe;
    this.dark.input.checked = this.settings.dark;
  }
}
