// Accuracy panel: size, material and certificate of each object.

import { count, digits, withUnit } from "../format";
import type { SceneMessage } from "../protocol/messages";
import { element, section } from "./elements";

export class AccuracyPanel {
  private readonly list = element("div", { class: "accuracy" });
  readonly section = section("Accuracy", false, this.list);

  update(scenes: readonly SceneMessage[]): void {
    this.list.replaceChildren(
      ...scenes.flatMap((scene) =>
        scene.objects.map((object) =>
          element(
            "article",
            {},
            element("h3", { text: object.name }),
            element("p", {
              class: "secondary",
              text: `${count(object.nodes)} surface nodes, ${count(object.modes)} modes, ${withUnit(1000 * object.mass, "g")}${materialText(object.material)}`,
            }),
            element("ul", {}, ...object.certificate.map((line) => element("li", { text: String(line) }))),
          ),
        ),
      ),
    );
    this.section.title = "Certificate of the recording: its error against the full finite element model";
  }
}

function materialText(material: SceneMessage["objects"][number]["material"]): string {
  if (material === null || material === undefined) return "";
  return `; ${withUnit(material.young, "Pa")}, Poisson's ratio ${digits(material.poisson)}, ${digits(material.density)} kg/m³`;
}
