import { Line } from '@react-three/drei'
import { useFrame } from '@react-three/fiber'
import { useMemo, useRef } from 'react'
import { Color, Vector3 } from 'three'
import { LineGeometry, type Line2 } from 'three-stdlib'

const MAX_POINTS = 600
/** Fraction of the colour at the oldest point. */
const OLDEST_FRACTION = 0.22

/**
 * The path of the tool up to the displayed time: a key that changes with the path, the index of the last
 * point, and the position of each point, m.
 */
export interface ToolPathPoints {
  key: string
  last: number
  point: (k: number) => [number, number, number]
}

/** The path of the tool up to the displayed time; older parts fade. */
export function ToolPath({
  path,
  dark,
  background,
}: {
  path: () => ToolPathPoints | undefined
  dark: boolean
  background: string
}) {
  const line = useRef<Line2>(null)
  const drawnKey = useRef('')
  const start = useMemo(() => [new Vector3(), new Vector3(0, 0, 1e-6)], [])
  const colour = dark ? '#3d9fdc' : '#0072b2'
  const white = useMemo<[number, number, number][]>(
    () => [
      [1, 1, 1],
      [1, 1, 1],
    ],
    [],
  )
  useFrame(() => {
    const current = path()
    const key = `${current?.key} ${colour}`
    if (!line.current || key === drawnKey.current) return
    drawnKey.current = key
    line.current.visible = Boolean(current) && current!.last > 0
    if (!current || current.last < 1) return
    const stride = Math.max(1, Math.ceil(current.last / MAX_POINTS))
    const points: number[] = []
    const colours: number[] = []
    const old = new Color(background).lerp(new Color(colour), OLDEST_FRACTION)
    const newest = new Color(colour)
    const shade = new Color()
    const addPoint = (k: number) => {
      points.push(...current.point(k))
      shade.copy(old).lerp(newest, (k / current.last) ** 1.5)
      colours.push(shade.r, shade.g, shade.b)
    }
    for (let k = 0; k < current.last; k += stride) addPoint(k)
    addPoint(current.last)
    // A geometry keeps its first instance count, so a longer line needs a new geometry.
    line.current.geometry.dispose()
    line.current.geometry = new LineGeometry()
    line.current.geometry.setPositions(points)
    line.current.geometry.setColors(colours)
  })
  return (
    <Line
      ref={line}
      points={start}
      vertexColors={white}
      lineWidth={2.4}
      frustumCulled={false}
      toneMapped={false}
    />
  )
}
