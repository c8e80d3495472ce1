// Files that are dropped onto the page.

import { element } from "./elements";

/** Takes files that are dropped onto the page; `text` tells what can be dropped. */
export function listenForDrops(text: string, open: (files: File[]) => void): void {
  const target = element("div", { class: "drop-target", text });
  const holdsFiles = (event: DragEvent) => event.dataTransfer?.types.includes("Files") === true;
  document.body.append(target);
  window.addEventListener("dragover", (event) => {
    if (!holdsFiles(event)) return;
    event.preventDefault();
    target.classList.add("visible");
  });
  window.addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) target.classList.remove("visible");
  });
  window.addEventListener("drop", (event) => {
    if (!holdsFiles(event)) return;
    event.preventDefault();
    target.classList.remove("visible");
    const files = [...(event.dataTransfer?.files ?? [])];
    if (files.length > 0) open(files);
  });
}
