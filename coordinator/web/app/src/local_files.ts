// Files and folders that somebody dropped or chose, by their path inside what was dropped.

export interface LocalFile {
  path: string;
  file: File;
}

const kMostFiles = 100000;
const kMostLookedInto = 100;
const kLookedInto = 1 << 18; // bytes
const kSceneFile = /\.(pbrt|gltf|glb)$/i;
const kPicture = /\.(exr|hdr|png|jpe?g|tga|tiff?|pfm)$/i;

async function entriesOf(folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = folder.createReader();
  const all: FileSystemEntry[] = [];
  for (;;) {
    // It tells a hundred or so at a time, and none at the end.
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return all;
    all.push(...some);
  }
}

async function collect(entry: FileSystemEntry, into: LocalFile[]): Promise<void> {
  if (into.length >= kMostFiles) throw new Error(`more than ${kMostFiles} files; drop the scene's folder alone`);
  if (entry.isFile) {
    const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
    into.push({ path: entry.fullPath.replace(/^\/+/, ""), file });
  } else if (entry.isDirectory) {
    for (const child of await entriesOf(entry as FileSystemDirectoryEntry)) await collect(child, into);
  }
}

/** To be called in the event's own turn, as what was dropped is gone afterwards. */
export async function droppedFiles(transfer: DataTransfer): Promise<LocalFile[]> {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry()).filter((entry) => entry !== null);
  const plain = [...transfer.files];
  const files: LocalFile[] = [];
  for (const entry of entries) await collect(entry, files);
  return entries.length > 0 ? files : plain.map((file) => ({ path: file.name, file }));
}

export function chosenFiles(list: FileList): LocalFile[] {
  return [...list].map((file) => ({ path: file.webkitRelativePath || file.name, file }));
}

/** Scene files: those that begin a world before those that are included by others, near the top first. */
export async function sceneFiles(files: LocalFile[]): Promise<LocalFile[]> {
  const candidates = files.filter((f) => kSceneFile.test(f.path));
  const ranked = await Promise.all(
    candidates.map(async (f, i) => {
      const pbrt = /\.pbrt$/i.test(f.path);
      const part = pbrt && i < kMostLookedInto && !/^\s*WorldBegin/m.test(await f.file.slice(0, kLookedInto).text());
      return { f, rank: 1000 * Number(part) + f.path.split("/").length };
    }),
  );
  return ranked.sort((a, b) => a.rank - b.rank || a.f.path.localeCompare(b.f.path)).map(({ f }) => f);
}

export function pictures(files: LocalFile[]): LocalFile[] {
  return files.filter((f) => kPicture.test(f.path)).sort((a, b) => a.path.localeCompare(b.path));
}

export function folderOf(path: string): string {
  return path.slice(0, path.lastIndexOf("/") + 1);
}

/** "a/b/../c.png" of the folder "x/" -> "x/a/c.png"; undefined for what lies above all, or is absolute. */
export function pathFrom(folder: string, reference: string): string | undefined {
  if (/^([a-z]:)?[\\/]/i.test(reference)) return undefined;
  const parts: string[] = [];
  for (const part of (folder + reference).split("/")) {
    if (part === "" || part === ".") continue;
    if (part !== "..") parts.push(part);
    else if (parts.pop() === undefined) return undefined;
  }
  return parts.join("/");
}
