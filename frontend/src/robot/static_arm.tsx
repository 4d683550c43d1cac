import { useEffect, useState } from 'react'

const CHECK_MS = 300

interface StaticArmProps {
  name: string
  drawing: () => Promise<string | undefined>
  state: () => string
  children?: React.ReactNode
}

/** The view without WebGL: a text, and a drawing from the server. */
export function StaticArm({ name, drawing, state, children }: StaticArmProps) {
  const [svg, setSvg] = useState<string>()
  useEffect(() => {
    let mounted = true
    let drawn: string | undefined
    const redrawIfChanged = () => {
      const present = state()
      if (present === drawn) return
      drawn = present
      void drawing().then((svgText) => mounted && setSvg(svgText))
    }
    redrawIfChanged()
    const timer = setInterval(redrawIfChanged, CHECK_MS)
    return () => {
      mounted = false
      clearInterval(timer)
    }
  }, [drawing, state])
  return (
    <figure className="robot still">
      {svg && <img src={`data:image/svg+xml;utf8,${encodeURIComponent(svg)}`} alt={`The robot ${name}`} />}
      <figcaption className="empty">
        This browser has no WebGL, so the arm is shown as a still picture. Runs, scopes and the editor work as
        usual. Turn hardware acceleration on in the browser's settings to see the arm move.
      </figcaption>
      {children && <div className="view-tools">{children}</div>}
    </figure>
  )
}
