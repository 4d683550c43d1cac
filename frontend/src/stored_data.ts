/** Data that the front end stored in the browser. `null` if there are none, or if they cannot be read. */
export function storedData<Data>(storage: Storage, key: string): Data | null {
  try {
    return JSON.parse(storage.getItem(key) ?? 'null') as Data | null
  } catch {
    return null
  }
}
