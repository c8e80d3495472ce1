// Addresses that are given to others: without token, and with what limits their use.

/** Address of a page with another query, without token, user and fragment. */
export function addressWith(page: string, query: string): string {
  const url = new URL(page);
  url.username = url.password = url.hash = "";
  url.search = "";
  return url.href + query;
}

/** Whether a host name is that of the computer itself. */
export function isLoopback(hostname: string): boolean {
  return hostname === "localhost" || hostname.endsWith(".localhost") || /^127\.\d+\.\d+\.\d+$/.test(hostname) || hostname === "[::1]";
}

/** Sentences on who can't open a link to a page. */
export function limitsOf(page: string, hasToken: boolean): string[] {
  const { hostname } = new URL(page);
  const limits: string[] = [];
  if (isLoopback(hostname)) limits.push(`${hostname} is this computer: the link works on this computer only.`);
  if (hasToken) limits.push("This server asks for a token, which the link leaves out: others add token=… from the address that palpate printed.");
  return limits;
}

const ESCAPES: Record<string, string> = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };

/** HTML of a frame that shows a page. */
export function frameHtml(address: string, title: string): string {
  const escaped = (text: string) => text.replace(/[&<>"]/g, (character) => ESCAPES[character]);
  return `<iframe src="${escaped(address)}" title="${escaped(title)}" width="800" height="600" style="border: 0" allow="autoplay; clipboard-write; cross-origin-isolated; fullscreen; gamepad"></iframe>`;
}
