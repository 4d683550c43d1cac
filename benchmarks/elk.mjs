// Reads a list of graphs from standard input and writes them with the node positions of elkjs.
import { createRequire } from 'node:module'
import { readFileSync } from 'node:fs'

const Elk = createRequire(`${process.env.ARMBLOCKS_ELKJS}/`)('elkjs')
const elk = new Elk()
const graphs = JSON.parse(readFileSync(0, 'utf8'))
const placed = []
for (const graph of graphs) placed.push(await elk.layout(graph))
process.stdout.write(JSON.stringify(placed))
