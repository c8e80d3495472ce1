// Token of the server: taken out of the address at once, so that neither the history nor a shared screen shows it, and kept for
// this tab, so that the page can be reloaded.

const STORAGE_KEY = "palpate.token";

let taken: string | null | undefined;

/** Token that the page was opened with, or null. */
export function token(): string | null {
  if (taken === undefined) taken = takeFromAddress();
  return taken;
}

function takeFromAddress(): string | null {
  const url = new URL(window.location.href);
  const given = url.searchParams.get("token");
  try {
    if (given === null) return sessionStorage.getItem(STORAGE_KEY);
    sessionStorage.setItem(STORAGE_KEY, given);
  } catch {
    // Without storage the address must keep it.
    return given;
  }
  url.searchParams.delete("token");
  history.replaceState(history.state, "", url);
  return given;
}
