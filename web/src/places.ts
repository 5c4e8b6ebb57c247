// Where this package's own files are.

/**
 * Where a file of this package is for a script that Vite's development server has bundled beforehand: into a folder of its own, in which
 * nothing else of the package is. `null` for any other script: there the file is beside it.
 */
export function unbundled(script: string, name: string): string | null {
  const [, modules] = /^(.*)\/\.vite\/deps[^/]*\/[^/]*$/.exec(script) ?? [];
  return modules === undefined ? null : `${modules}/unweld/dist/${name}`;
}
