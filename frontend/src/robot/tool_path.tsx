import { Line } from '@react-three/drei'
import { useFrame } from '@react-three/fiber'
import { useMemo, useRef } from 'react'
import { Color, Vector3 } from 'three'
import { LineGeometry, type Line2 } from 'three-stdlib'

const MOST_POINTS = 600
/** How much of the colour the oldest point keeps. */
const OLDEST = 0.22

/**
 * The way of the tool so far: how many points there are, what tells one state of it from another, and each
 * point.
 */
export interface Way {
  key: string
  last: number
  point: (k: number) => [number, number, number]
}

/** The way of the tool up to the instant shown; what is old fades. */
export function ToolPath({
  way,
  dark,
  background,
}: {
  way: () => Way | undefined
  dark: boolean
  background: string
}) {
  const line = useRef<Line2>(null)
  const seen = useRef('')
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
    const now = way()
    const key = `${now?.key} ${colour}`
    if (!line.current || key === seen.current) return
    seen.current = key
    line.current.visible = Boolean(now) && now!.last > 0
    if (!now || now.last < 1) return
    const stride = Math.max(1, Math.ceil(now.last / MOST_POINTS))
    const points: number[] = []
    const colours: number[] = []
    const old = new Color(background).lerp(new Color(colour), OLDEST)
    const fresh = new Color(colour)
    const shade = new Color()
    const put = (k: number) => {
      points.push(...now.point(k))
      shade.copy(old).lerp(fresh, (k / now.last) ** 1.5)
      colours.push(shade.r, shade.g, shade.b)
    }
    for (let k = 0; k < now.last; k += stride) put(k)
    put(now.last)
    // A geometry keeps the count of instances that it had first: a longer line needs a new one.
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
