import { IconAlertTriangle } from '@tabler/icons-react'
import { shortNumber, useRobotEditor } from './state'

const ROWS = ['vx', 'vy', 'vz', 'ωx', 'ωy', 'ωz']

/**
 * The read-outs of the arm in its present configuration, computed by the server: pose of the tool,
 * Jacobian, torques.
 */
export function ReadingsPanel() {
  const robot = useRobotEditor((s) => (s.current ? s.robots[s.current] : undefined))
  const readings = useRobotEditor((s) => s.readings)
  const angles = useRobotEditor((s) => s.angles)
  if (!robot) return null
  const names = robot.links.filter(({ moves }) => moves).map(({ name }) => name)
  const turns = robot.links.filter(({ moves }) => moves).map((link) => link.turns)
  if (!names.length) return <p className="empty">The robot has no movable joint.</p>
  if (!readings) return <p className="empty">Compiling the arm …</p>
  const { pose, position, rpy, jacobian, gravload, torque, manipulability, singular, limits } = readings
  const angle = (value: number) =>
    angles === 'deg' ? `${shortNumber((value * 180) / Math.PI, 3)}°` : `${shortNumber(value)} rad`
  const warnings = [...(singular ? [singular] : []), ...limits.map((text) => `${text}.`)]
  return (
    <div className="readings" role="group" aria-label="Read-outs" tabIndex={0}>
      <section aria-label="Pose of the tool">
        <h3>Tool in the world</h3>
        <dl className="pairs numbers">
          {position.map((value, k) => (
            <div key={k}>
              <dt>{'xyz'[k]}</dt>
              <dd>{shortNumber(value)} m</dd>
            </div>
          ))}
          {rpy.map((value, k) => (
            <div key={k}>
              <dt>{['roll', 'pitch', 'yaw'][k]}</dt>
              <dd>{angle(value)}</dd>
            </div>
          ))}
        </dl>
        <Matrix label="Transform T" rows={pose} />
      </section>
      {warnings.length > 0 && (
        <ul className="warnings" aria-label="Notices">
          {warnings.map((text) => (
            <li key={text}>
              <IconAlertTriangle size={14} aria-hidden /> {text}
            </li>
          ))}
        </ul>
      )}
      <section aria-label="Torques">
        <h3>Joint torques</h3>
        <table className="numbers">
          <thead>
            <tr>
              <th />
              <th scope="col">gravity</th>
              <th scope="col">rne</th>
              <th />
            </tr>
          </thead>
          <tbody>
            {names.map((name, k) => (
              <tr key={name}>
                <th scope="row">{name}</th>
                <td>{shortNumber(gravload[k] ?? 0, 3)}</td>
                <td>{shortNumber(torque[k] ?? 0, 3)}</td>
                <td className="unit">{turns[k] ? 'N m' : 'N'}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </section>
      <section aria-label="Jacobian">
        <h3>
          Jacobian <small>world axes; manipulability {shortNumber(manipulability)}</small>
        </h3>
        <Matrix label="Jacobian J" rows={jacobian} heads={ROWS} columns={names} />
      </section>
    </div>
  )
}

function Matrix({
  label,
  rows,
  heads: rowHeads,
  columns,
}: {
  label: string
  rows: number[][]
  heads?: string[]
  columns?: string[]
}) {
  return (
    <div className="scrolled">
      <table className="matrix numbers" aria-label={label}>
        {columns && (
          <thead>
            <tr>
              <th />
              {columns.map((column) => (
                <th key={column} scope="col">
                  {column}
                </th>
              ))}
            </tr>
          </thead>
        )}
        <tbody>
          {rows.map((row, i) => (
            <tr key={i}>
              {rowHeads && <th scope="row">{rowHeads[i]}</th>}
              {row.map((value, j) => (
                <td key={j}>{shortNumber(value, 3)}</td>
              ))}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  )
}
