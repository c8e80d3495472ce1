// Files that go to the browser's downloads.

import { element } from "./elements";

/** Time after which the address of a download is given back [ms]. */
const DOWNLOAD_MS = 60_000;

/** Hands a file to the downloads. */
export function saveFile(data: Blob, name: string): void {
  const address = URL.createObjectURL(data);
  element("a", { attributes: { href: address, download: name } }).click();
  window.setTimeout(() => URL.revokeObjectURL(address), DOWNLOAD_MS);
}
