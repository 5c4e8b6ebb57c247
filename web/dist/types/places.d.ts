/**
 * Where a file of this package is for a script that Vite's development server has bundled beforehand: into a folder of its own, in which
 * nothing else of the package is. `null` for any other script: there the file is beside it.
 */
export declare function unbundled(script: string, name: string): string | null;
