import { Canvas } from '../canvas/canvas'
import type { Panel } from '../panel'

export const panel: Panel = { title: 'Diagram', component: Canvas, order: 1 }
