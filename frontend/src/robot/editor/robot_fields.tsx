import type { CellColumn } from '../../protocol'
import { unitOf, useRobotEditor, type OpenRobot } from './state'
import { Cell } from './table'

/** The properties of the whole robot: name, base, tool, gravity and friction. */
export function RobotFields({ shown, columns }: { shown: OpenRobot; columns: CellColumn[] }) {
  const angles = useRobotEditor((s) => s.angles)
  const groups = [...new Set(columns.map(({ group }) => group))]
  return (
    <div className="robot-fields">
      {groups.map((group) => (
        <fieldset key={group} className={group ? undefined : 'texts'}>
          <legend>{group || 'Robot'}</legend>
          {columns
            .filter((column) => column.group === group)
            .map((column) => (
              <label key={column.name} title={column.doc}>
                <span>
                  {column.title}{' '}
                  {unitOf(column, angles) && <span className="unit">{unitOf(column, angles)}</span>}
                </span>
                <Cell
                  owner=""
                  turns={false}
                  value={shown.fields[column.name] ?? null}
                  column={column}
                  angles={angles}
                />
              </label>
            ))}
        </fieldset>
      ))}
    </div>
  )
}
