// Logs that were dropped onto the page, kept by the browser: the page of logs opens them, and again when it is reloaded.

const DATABASE = "palpate";
const STORE = "logs";

function request<T>(of: IDBRequest<T>): Promise<T> {
  return new Promise((done, failed) => {
    of.onsuccess = () => done(of.result);
    of.onerror = () => failed(of.error ?? new Error("the browser's store cannot be used"));
  });
}

async function open(): Promise<IDBDatabase> {
  const opening = indexedDB.open(DATABASE, 1);
  opening.onupgradeneeded = () => opening.result.createObjectStore(STORE);
  return request(opening);
}

/** Keeps logs in place of those before. */
export async function keepLogs(logs: readonly File[]): Promise<void> {
  const database = await open();
  try {
    const transaction = database.transaction(STORE, "readwrite");
    const store = transaction.objectStore(STORE);
    const done = new Promise<void>((kept, failed) => {
      transaction.oncomplete = () => kept();
      transaction.onabort = () => failed(transaction.error ?? new Error("the browser did not keep the log"));
    });
    store.clear();
    logs.forEach((log, number) => store.put(log, number));
    await done;
  } finally {
    database.close();
  }
}

/** Logs that are kept, in their order. */
export async function keptLogs(): Promise<File[]> {
  const database = await open();
  try {
    return (await request(database.transaction(STORE).objectStore(STORE).getAll())) as File[];
  } finally {
    database.close();
  }
}
