import { useEffect, useState } from 'react'

/** What is shown where the browser has no WebGL: words, and a drawing that the server makes. */
export function StaticArm({ name, drawing }: { name: string; drawing: () => Promise<string | undefined> }) {
  const [svg, setSvg] = useState<string>()
  useEffect(() => {
    let current = true
    void drawing().then((found) => current && setSvg(found))
    return () => {
      current = false
    }
  }, [drawing])
  return (
    <figure className="robot still">
      {svg && <img src={`data:image/svg+xml;utf8,${encodeURIComponent(svg)}`} alt={`The robot ${name}`} />}
      <figcaption className="empty">
        This browser shows no 3-D (WebGL is off or missing), so the arm stands still here. Runs, scopes and the editor work as usual. Turn
        hardware acceleration on in the browser's settings to see it move.
      </figcaption>
    </figure>
  )
}
