// A page of `studio/view_server.py`: the widget of notebooks, whose model is the server instead of a kernel.

import widget from './notebook_widget.js'

const [content, samples] = await Promise.all([
  fetch('content').then((reply) => reply.json()),
  fetch('samples').then((reply) => reply.arrayBuffer()),
])
const listeners = {}
const values = {
  title: content.title,
  height: 0,
  time: null,
  joints: [],
  _poses: null,
  _live: true,
  _page: content.page,
  _shown: content.shown,
  _frame: new DataView(samples),
}
const change = (name, value) => {
  values[name] = value
  for (const listener of listeners[`change:${name}`] ?? []) listener()
}
let shown = 0
// The reply to a movement of a slider may arrive after a later event.
const showArm = ({ q, poses, number }) => {
  if (number < shown) return
  shown = number
  values.joints = q
  change('_poses', { q, poses })
}
let sentJoints = values.joints
const model = {
  get: (name) => values[name],
  set: change,
  save_changes: async () => {
    if (values.joints === sentJoints) return
    sentJoints = values.joints
    const reply = await fetch('joints', { method: 'POST', body: JSON.stringify(sentJoints) }).catch(() => null)
    if (reply?.ok) showArm(await reply.json())
    else change('_live', false)
  },
  on: (name, listener) => (listeners[name] ??= []).push(listener),
  off: () => {},
}
const el = document.getElementById('view')
widget.render({ model, el })
const frame = el.querySelector('iframe')
frame.style.height = '100vh'
// The event stream is opened after the page has loaded all data, because the program may then end.
frame.addEventListener('load', () => {
  const events = new EventSource('events')
  events.onopen = () => change('_live', true)
  events.onerror = () => change('_live', false)
  events.onmessage = ({ data }) => {
    const event = JSON.parse(data)
    if (!event.closed) return showArm(event)
    events.close()
    change('_live', false)
  }
})
