import { Anchor } from '@mantine/core'
import { openTour } from '../dialogs'
import { ask, useStudio } from '../store'

/** The view of an empty sheet: first steps, and the examples with their pictures. */
export function Welcome() {
  const examples = useStudio((s) => s.welcome?.examples ?? {})
  return (
    <div className="welcome">
      <div>
        <header>
          <h2>Type to add a block</h2>
          <p>
            Or drag one from the library, or begin with an example.{' '}
            <Anchor component="button" size="sm" onClick={openTour}>
              Take the tour
            </Anchor>
          </p>
        </header>
        <div className="gallery" role="list" aria-label="Examples">
          {Object.entries(examples).map(([name, description]) => (
            <div key={name} role="listitem" style={{ display: 'contents' }}>
              <button
                type="button"
                onClick={() => void ask({ kind: 'open_shipped', document_kind: 'diagram', name })}
              >
                <img src={`example/${name}.svg`} alt="" loading="lazy" />
                <b>{name}</b>
                <small>{description}</small>
              </button>
            </div>
          ))}
        </div>
      </div>
    </div>
  )
}
