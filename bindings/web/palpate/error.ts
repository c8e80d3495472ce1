/** Error of palpate: a file, scene or motion that it refuses. */
export class PalpateError extends Error {
  override name = "PalpateError";
}
